"""Stretches beyond what is usual: how often by chance, and how much of a push."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.physics import pushes
from fieldcal.physics.pushes import (
    UsualSpread,
    disturbed_stretches,
    running_means,
    usual_spread,
)

M = 10


def noise(seed: int, n: int = 3000) -> Array:
    return np.random.default_rng(seed).standard_normal((n, 6))


@pytest.mark.parametrize("count", [100, pytest.param(300, marks=pytest.mark.thorough)])
def test_noise_is_pushed_in_less_than_one_window_of_a_hundred(count: int) -> None:
    pushed = [len(disturbed_stretches(noise(seed), M)) > 0 for seed in range(count)]
    assert sum(pushed) <= count / 100


@pytest.mark.parametrize("n", [800, 3000])
def test_a_gentle_push_is_found_whole_and_no_sample_of_it_stands_out(n: int) -> None:
    """Its mean over 40 samples is 13 sigma."""
    for seed in range(10):
        z = noise(seed, n)
        z[200:240, 2] += 13.0 / np.sqrt(40)
        ((first, last),) = disturbed_stretches(z, M)
        assert abs(first - 200) <= 24 and abs(last - 240) <= 24


def test_what_trembles_throughout_is_not_pushed() -> None:
    """A walk of short memory: its means go as far as those of a push, all the time."""
    for seed in range(20):
        z, drawn = noise(seed), noise(seed + 100)
        course = np.zeros(6)
        for i, one in enumerate(drawn):
            course = 0.97 * course + 0.3 * one
            z[i] += course
        assert len(disturbed_stretches(z, M)) == 0


def test_what_is_usual_does_not_count_where_it_is_most() -> None:
    """The means of a window of which a tenth was pushed are as wide as without."""
    z = noise(5, 600)
    calm = UsualSpread.of(z, M).means[4 * M]
    z[200:260] += 3.0
    assert np.abs(UsualSpread.of(z, M).means[4 * M] / calm - 1).max() < 0.6


def test_a_part_is_judged_by_what_is_usual_in_the_whole() -> None:
    """Of 200 samples half are pushed; by themselves they would do so throughout."""
    z = noise(6)
    z[1000:1100] += 2.0
    there, part = UsualSpread.of(z, M), z[950:1150]
    found = disturbed_stretches(part, M, there)
    assert abs(found[0, 0] - 50) <= 24 and abs(found[-1, 1] - 150) <= 24
    assert np.diff(found, axis=1).sum() > 60
    assert len(disturbed_stretches(part, M)) == 0


@pytest.mark.parametrize("seed", range(40))
def test_the_spread_of_means_is_that_of_those_away_from_the_largest(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    monkeypatch.setattr(pushes, "MAX_SPREAD_VALUES", 50)
    width, z = int(rng.integers(2, 40)), 3.0 * rng.standard_normal((300, 1))
    z[rng.integers(300)] += 50.0
    (mean,) = running_means(z[:, 0], [width])
    slow = [abs(z[i : i + width].sum()) / width**0.5 for i in range(301 - width)]
    assert mean == pytest.approx(np.array(slow))
    at = int(np.argmax(mean))
    rest = np.delete(mean, slice(max(at - width + 1, 0), at + width))
    assert pushes._usual_mean(mean, width) == usual_spread(rest[:, None])
