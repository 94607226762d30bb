"""Sessions of the campaign: each of these ended in GO once, and was wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.never_wrong.bench import drawn
from benchmarks.never_wrong.judging import WRONG, Judged, judged, write
from benchmarks.never_wrong.mistakes import session, spoilt

LIMIT = 600.0


def of(folder: Path, seed: int, *names: str) -> Judged:
    rng = np.random.default_rng(seed)
    bench = spoilt(drawn(rng), names, rng)
    write(folder, session(bench, names, rng))
    return judged(folder, bench.truth, bench.grade, False, LIMIT)


def test_turns_are_not_followed_with_a_scale_factor_by_the_earth_alone(
    tmp_path: Path,
) -> None:
    found = of(tmp_path / "six", 93_000_015)
    assert found.go and 0 < found.off < WRONG


@pytest.mark.parametrize(
    ("mistake", "why"),
    [
        pytest.param(
            "outputs exchanged",
            "the gyroscopes lead to another attitude",
            marks=pytest.mark.thorough,
        ),
        ("rad/s labelled deg/s", "unit = rad/s read as deg/s"),
    ],
)
def test_gyroscopes_that_follow_other_turns_are_wrong_without_any_angle(
    tmp_path: Path, mistake: str, why: str
) -> None:
    found = of(tmp_path / "twelve", 93_000_003, mistake)
    assert not found.go and why in found.says
