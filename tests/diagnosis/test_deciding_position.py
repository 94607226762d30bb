"""The next step is one that the session's ladder can do, and it does decide."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import places, recorded, write_session

from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.diagnosis.wording.deciding_position import median_known
from fieldcal.session.folder import Session
from fieldcal.sim_device.profile import NoiseFigures, Profile
from fieldcal.sim_device.vocabulary import parse

QUIET = NoiseFigures(acc_instability=(0, 0, 0), gyr_instability=(0, 0, 0))
FIVE = ((0.0, 0.0), (22.5, 0.0), (22.5, 2.5), (45.0, 2.5), (45.0, 5.0))
"""A ladder of 45° and 5°, turned to one side."""


def found_in(folder: Path, angles: tuple[tuple[float, float], ...]) -> Diagnosis:
    device = replace(Profile(noise=QUIET), effects=(parse("cross_coupling:k21=0.006"),))
    positions = places(angles)
    block = recorded(device, positions)
    session = Session.open(write_session(folder, block, positions))
    return diagnose(session.block, session.about)


def test_the_position_that_is_asked_for_is_on_the_ladder_and_decides(
    tmp_path: Path,
) -> None:
    first = found_in(tmp_path / "five", FIVE)
    assert first.verdict == "ambiguous"
    step = first.next[0]
    assert "it distinguishes cross_coupling from" in step and "σ apart there" in step
    alpha, beta = map(float, re.findall(r"= (-?[\d.]+)°", step))
    assert {abs(alpha), abs(beta)} <= {0.0, 22.5, 45.0, 2.5, 5.0}
    assert abs(alpha) <= 45.0 and abs(beta) <= 5.0
    then = found_in(tmp_path / "six", (*FIVE, (alpha, beta)))
    assert then.verdict == "left_out"
    assert [(e.id, e.aliases) for e in then.effects] == [("cross_coupling", ())]


@pytest.mark.thorough
def test_what_an_effect_does_is_the_change_of_the_calibration(tmp_path: Path) -> None:
    """The model's numbers with and without it differ by what is stated."""
    found = found_in(tmp_path, (*FIVE, (-45.0, 0.0)))
    (effect,) = found.effects
    assert set(effect.moves) >= {"acc_bias.x", "acc_bias.y", "acc_scale.y"}
    # cross-coupling of the axes of gravity is taken by biases where nothing else can
    sizes = [abs(float(q.value)) / (q.sigma or 1.0) for q in effect.moves.values()]
    assert max(sizes) > 3.0
    for name, by in effect.moves.items():
        group, axis = name.split(".")
        sigma = found.calibration[group].sigma["xyz".index(axis)]
        assert by.sigma == sigma
    (line,) = found.lines
    assert line.what == "cross coupling" and line.size.startswith("k21 0.00")
    assert line.sure == "above 0.99" and "σ)" in line.does


def test_an_output_that_was_not_recorded_has_no_noise_and_no_warning() -> None:
    rows = np.array([[1.0, np.nan, np.nan], [3.0, np.nan, 5.0], [9.0, np.nan, 7.0]])
    with np.errstate(all="raise"):
        found = median_known(rows)
    np.testing.assert_array_equal(found, [3.0, np.nan, 6.0])
