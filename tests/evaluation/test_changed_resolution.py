"""Means of windows where the resolution of the outputs changes amid the recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from ladder import LADDER, TACTICAL, Device, record, ride, windows
from ladder_sessions import tables
from session_folders import write_session

from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session

COARSE = 0.036


def test_a_mean_is_that_of_one_grid_and_as_uncertain_as_that_leaves_it(
    tmp_path: Path,
) -> None:
    """In the coarse stretch up to half a step is missing, and it is not still."""
    quiet = Device(acc_noise=0.001, acc_bias=TACTICAL.acc_bias)
    start, end = windows()[3]
    at, pulls = (start + end) / 2, []
    for seed in range(3):
        block = record(quiet, ride(quiet, seed))
        step = np.where(block.t < at, 1e-5, COARSE)[:, None]
        changed = replace(block, acc=np.round(block.acc / step) * step)
        said = tables(quiet)
        folder = write_session(tmp_path / f"{seed}", changed, said.pop("position"))
        found = usable_windows(Session.open(folder))
        assert len(found.averages) == len(LADDER), "no window is left out"
        (remark,) = found.warnings
        assert remark.startswith("position 4") and "resolution" in remark
        held = zip(windows(), found.averages, strict=True)
        for i, ((a, b), average) in enumerate(held):
            true = block.between(a, b).acc.mean(axis=0)
            sigma = np.sqrt(np.diag(average.covariance))[:3]
            pulls.append((average.mean[:3] - true) / sigma)
            fine = COARSE > 20 * sigma
            assert fine.all() if i < 4 else not fine.all(), i
        assert found.averages[3].end < at
    assert np.abs(pulls).max() < 3.0
