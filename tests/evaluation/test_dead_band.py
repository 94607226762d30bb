"""Gyroscopes that are zero as long as they measure less than their noise hides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.diagnosis import diagnose
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import ZERO, NoiseFigures, Profile, Truth

FACES = [(0.0, 0.0), (180.0, 0.0), (90.0, 0.0), (-90.0, 0.0), (0.0, 90.0), (0.0, -90.0)]
BAND = 3.5e-3
DEVICE = Profile(
    truth=Truth(gyr_bias=(-3.2e-3, 1.7e-3, 2.3e-3), gyr_scale=(0.999, 1.004, 1.002)),
    noise=NoiseFigures(
        acc=(3e-3,) * 3, gyr=(1.6e-3,) * 3, acc_instability=ZERO, gyr_instability=ZERO
    ),
)


@pytest.mark.thorough
def test_their_biases_are_read_from_the_turns_which_leave_the_band(
    tmp_path: Path,
) -> None:
    """Means at rest, of samples most of which are zero, are a third of the bias."""
    positions = places(FACES, 10.0, 6.0)
    block = recorded(DEVICE, positions, seed=1)
    gyr = np.where(np.abs(block.gyr) < BAND, 0.0, block.gyr)
    folder = write_session(tmp_path / "faces", replace(block, gyr=gyr), positions)
    session = Session.open(folder)
    found = solve_session(session, usable_windows(session))
    truth = DEVICE.truth
    means = usable_windows(session).averages[0].mean[3:]
    assert np.abs(means - truth.gyr_bias).max() > 5e-4
    for i, axis in enumerate("xyz"):
        for group, true in (("bias", truth.gyr_bias), ("scale", truth.gyr_scale)):
            name = f"gyr_{group}.{axis}"
            assert abs(found.value(name) - true[i]) < 4 * found.uncertainty(name), name
    assert any("zero where less than 0.0035 rad/s" in w for w in found.warnings)


def test_diagnose_says_that_there_is_a_band(tmp_path: Path) -> None:
    positions = places(FACES[:3], 5.0, 3.0)
    block = recorded(DEVICE, positions, seed=1)
    gyr = np.where(np.abs(block.gyr) < BAND, 0.0, block.gyr)
    for band, samples in ((True, replace(block, gyr=gyr)), (False, block)):
        folder = write_session(tmp_path / f"{band}", samples, positions)
        session = Session.open(folder)
        found = diagnose(session.block, session.about)
        said = [w for w in found.warnings if "zero where less than 0.0035 rad/s" in w]
        assert len(said) == band
