"""Samples of two sensors with times of their own go together, however they are cut."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.times.alignment import AlignedPair

SLOW = np.arange(0.0, 200.0, 0.02)
OFTEN = np.arange(0.001, 200.0, 0.0025)


def forces(t: Array) -> Block:
    """Samples of the accelerometer that hold their own time."""
    return Block.of(t, np.repeat(t[:, None], 3, axis=1))


def rates(t: Array) -> Block:
    """Samples of the gyroscope that hold their own time."""
    unknown = np.full((len(t), 3), np.nan)
    return Block.of(t, unknown, np.repeat(t[:, None], 3, axis=1))


def pieces(whole: Block, rows: int) -> Iterator[Block]:
    """A flow of so many rows at a time."""
    yield from (whole[first : first + rows] for first in range(0, len(whole), rows))


@pytest.mark.parametrize(("slow", "often"), [(5000, 5000), (5000, 700), (70, 40000)])
def test_a_piece_may_span_more_time_the_slower_its_sensor_is(
    slow: int, often: int
) -> None:
    flows = pieces(forces(SLOW), slow), pieces(rates(OFTEN), often)
    found = concat(AlignedPair().through(*flows))
    assert np.array_equal(found.t, SLOW)
    after = np.searchsorted(OFTEN, SLOW).clip(1, len(OFTEN) - 1)
    both = OFTEN[[after - 1, after]]
    nearest = np.where(both[1] - SLOW < SLOW - both[0], both[1], both[0])
    np.testing.assert_array_equal(found.gyr[:, 0], nearest)


def test_a_gyroscope_that_ends_earlier_leaves_the_accelerometer_alone() -> None:
    flows = pieces(forces(SLOW), 500), pieces(rates(OFTEN[OFTEN < 30.0]), 5000)
    found = concat(AlignedPair().through(*flows))
    assert np.array_equal(found.t, SLOW)
    known = np.isfinite(found.gyr[:, 0])
    assert np.array_equal(known, SLOW < 30.005)
