"""Six faces behind a slow filter, whose turns about two axes lead elsewhere."""

from __future__ import annotations

from pathlib import Path

import pytest
from session_folders import places, recorded, write_session

from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.model import priors
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import ZERO, NoiseFigures, Profile, Sampling
from fieldcal.sim_device.vocabulary import parse

FACES = [(0.0, 0.0), (180.0, 0.0), (90.0, 0.0), (-90.0, 0.0), (0.0, 90.0), (0.0, -90.0)]
DEVICE = Profile(
    sampling=Sampling(50.0),
    noise=NoiseFigures(
        acc=(3e-3,) * 3, gyr=(3e-4,) * 3, acc_instability=ZERO, gyr_instability=ZERO
    ),
    effects=(parse("bandwidth:acc=0.1,gyr=0.1"),),
)  # fmt: skip


@pytest.mark.parametrize(
    ("known_s", "right"),
    [
        (priors.FILTERED_S, True),
        pytest.param(1e-4, False, marks=pytest.mark.thorough),
    ],
)
def test_scale_factors_of_gyroscopes_are_right_behind_a_filter_of_100_ms(
    known_s: float, right: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of sensors that are taken to be quick, one is wrong or not known any more."""
    monkeypatch.setattr(priors, "FILTERED_S", known_s)
    positions = places(FACES, 10.0, 4.0)
    block = recorded(DEVICE, positions, seed=1)
    session = Session.open(write_session(tmp_path / "faces", block, positions))
    found = solve_session(session, usable_windows(session))
    good = []
    for axis, true in zip("xyz", DEVICE.truth.gyr_scale, strict=True):
        name = f"gyr_scale.{axis}"
        sigma, off = found.uncertainty(name), abs(found.value(name) - true)
        good.append(sigma < 1e-3 and off < 3 * sigma)
    assert all(good) == right
