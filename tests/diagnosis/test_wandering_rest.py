"""A rest in which a bias wanders by far more than any device does."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from session_folders import SITE, write_session

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis import Diagnosis, diagnose
from fieldcal.session.folder import Session

RATE, G = 100.0, 9.81


def told(folder: Path, course: Array, seed: int, lasts: Sequence[float]) -> Diagnosis:
    """What is said of a rest in which the force takes a course (n,), m/s^2."""
    rng, n = np.random.default_rng(seed), len(course)
    acc = [0.1, 0.2, G] + np.outer(course, [1.0, 0.4, 0.0])
    acc = acc + rng.normal(0, 0.02, (n, 3))
    gyr = 0.01 + rng.normal(0, 0.002, (n, 3))
    block = Block.of(np.arange(n) / RATE, acc, gyr)
    window = {"start_s": lasts[0], "end_s": lasts[1]}
    session = Session.open(write_session(folder, block, [window], site=SITE))
    return diagnose(session.block, session.about)


def walk(seconds: float, seed: int) -> Array:
    n = round(seconds * RATE)
    steps = np.random.default_rng(seed).normal(size=n)
    walked: Array = np.cumsum(steps) / np.sqrt(n)
    return walked


@pytest.mark.parametrize("seconds", [5.0, 10.0])
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.thorough)])
def test_a_walk_of_a_tenth_of_gravity_is_no_flicker(
    tmp_path: Path, seconds: float, seed: int
) -> None:
    said = told(tmp_path / "s", walk(seconds, seed), seed, (0.0, seconds))
    assert said.verdict != "consistent" and said.probability > 0.9


@pytest.mark.parametrize("seed", [1, 2])
def test_a_support_that_gives_way_by_degrees_is_told(tmp_path: Path, seed: int) -> None:
    course = np.sin(np.arange(500) / 500)
    said = told(tmp_path / "s", course, seed, (0.0, 5.0))
    assert said.verdict != "consistent" and said.probability > 0.9
