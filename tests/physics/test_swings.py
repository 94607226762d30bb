"""Swings beside a push, against the waves they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.physics.swings import WAVES, swings

HZ = 25.0
PUSH = (50, 75)


def noisy(*courses: Array, seed: int = 1) -> Array:
    """Outputs with a noise of a tenth."""
    six = np.column_stack(courses)
    return six + 0.1 * np.random.default_rng(seed).standard_normal(six.shape)


def waves(*hz: float, seconds: float = 5.0) -> Array:
    t = np.arange(round(seconds * HZ)) / HZ
    each = [np.sin(2 * np.pi * f * t + i) for i, f in enumerate(hz)]
    total: Array = 3.0 + np.sum(each, axis=0)
    return total


def half_sine() -> Array:
    out = np.zeros(125)
    out[slice(*PUSH)] = np.sin(np.pi * (np.arange(25) + 0.5) / 25)
    return out


@pytest.mark.parametrize("hz", [(0.31,), (0.5,), (0.8,), (0.45, 1.3), (0.4, 0.9, 1.7)])
def test_what_swings_before_and_after_a_push_is_predicted_in_it(
    hz: tuple[float, ...],
) -> None:
    near = noisy(waves(*hz))
    found = swings(near, PUSH, HZ)
    assert len(found) == WAVES
    amiss = [np.square((near - one)[slice(*PUSH)]).mean() ** 0.5 for one in found]
    assert min(amiss) < 0.25


def test_each_output_has_frequencies_of_its_own() -> None:
    near = noisy(waves(0.5), waves(0.9))
    course = swings(near, PUSH, HZ)[0]
    assert ((near - course).std(axis=0) < 0.2).all()


@pytest.mark.parametrize("size", [0.5, 20.0])
def test_a_push_is_left_as_large_as_it_is(size: float) -> None:
    """It has no part in what is fitted, however large it is."""
    for seed in range(5):
        near = noisy(size * half_sine(), seed=seed)
        for course in swings(near, PUSH, HZ):
            left = (near - course)[slice(*PUSH), 0]
            shape = half_sine()[slice(*PUSH)]
            assert left @ shape / (shape @ shape) == pytest.approx(size, abs=0.3)


def test_missing_samples_do_not_spoil_the_others() -> None:
    near = noisy(waves(0.5), waves(0.5), waves(0.5))
    near[:, 1] = np.nan
    near[5:15, 2] = np.nan
    for course in swings(near, PUSH, HZ):
        assert np.isfinite(course).all()
        assert np.ptp(course[:, 0]) > 1.5 and np.ptp(course[:, 2]) > 1.5


def test_less_than_a_period_of_the_quickest_tells_of_no_swing() -> None:
    assert swings(noisy(waves(0.5, seconds=0.4)), (3, 6), HZ) == []
