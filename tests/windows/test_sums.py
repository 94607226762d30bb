"""Sums over cells against loops over their samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array
from fieldcal.windows import sums

FIRST = np.array([0, 3, 4, 9])
N = 12


def samples(seed: int, missing: tuple[int, ...] = ()) -> tuple[Array, Array]:
    """Values (6, N) and their changes, the first from a value before them."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(6, N + 1))
    for place in missing:
        x[place % 6, place % (N + 1)] = np.nan
    return x[:, 1:], np.diff(x, axis=1)


def looped(x: Array, step: Array) -> Array:
    """n, S, D, m of each cell, value by value."""
    out = np.zeros((len(FIRST), 4, 6))
    for cell, (a, b) in enumerate(zip(FIRST, [*FIRST[1:], N], strict=True)):
        for channel in range(6):
            for i in range(a, b):
                if np.isfinite(x[channel, i]):
                    out[cell, 0, channel] += 1
                    out[cell, 1, channel] += x[channel, i]
                if np.isfinite(step[channel, i]):
                    out[cell, 2, channel] += step[channel, i] ** 2
                    out[cell, 3, channel] += 1
    return out


def test_sums_of_samples_that_are_all_there() -> None:
    x, step = samples(0)
    for whole in (True, False):
        found = sums.channel_sums(x, step, FIRST, whole)
        np.testing.assert_allclose(found, looped(x, step), atol=1e-12)


@given(st.integers(0, 99), st.lists(st.integers(0, 77), min_size=1, max_size=20))
def test_a_missing_value_enters_no_sum(seed: int, missing: list[int]) -> None:
    x, step = samples(seed, tuple(missing))
    found = sums.channel_sums(x, step, FIRST, False)
    np.testing.assert_allclose(found, looped(x, step), atol=1e-12)


@pytest.mark.parametrize("sensor", [slice(0, 3), slice(3, 6)])
def test_a_sensor_that_is_not_there_leaves_the_other_as_it_is(sensor: slice) -> None:
    x, _ = samples(1)
    x[sensor] = np.nan
    step = np.diff(x, axis=1, prepend=0.0)
    found = sums.channel_sums(x, step, FIRST, False)
    assert not found[..., sensor].any()
    np.testing.assert_allclose(found, looped(x, step), atol=1e-12)


def test_the_finest_change_is_the_smallest_that_is_one() -> None:
    step = np.zeros((2, N))
    step[0] = [0, -0.5, 2, 0, 0, 0.25, 0.5, -0.125, 0, 0, 0, np.nan]
    step[1] = np.arange(1, N + 1)
    found = sums.smallest_changes(step, FIRST)
    np.testing.assert_array_equal(found[:, 0], [0.5, np.inf, 0.125, np.inf])
    np.testing.assert_array_equal(found[:, 1], [1, 4, 5, 10])


def test_temperatures_are_summed_where_they_are_known() -> None:
    warm = np.array([20.0, np.nan, 22, 21, np.nan, 1, 2, 3, np.inf, np.nan, 5, 6])
    found = sums.temperature_sums(warm, FIRST)
    np.testing.assert_array_equal(found, [[42, 2], [21, 1], [6, 3], [11, 2]])
    unknown = sums.temperature_sums(np.full(N, np.nan), FIRST)
    np.testing.assert_array_equal(unknown, np.zeros((4, 2)))
