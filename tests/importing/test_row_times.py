"""Times of rows that share those of their batch."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array
from fieldcal.importing.recording import RowBatch
from fieldcal.importing.row_times import SpreadTimes

EACH, STEP = 10, 0.1
"""Rows of a batch, and s from one to the next."""


def stamped(
    n: int, first: int = EACH, late: Array | None = None
) -> tuple[Array, Array]:
    """When n rows were taken, and the times of their batches; the first has fewer."""
    batch = (np.arange(n) + EACH - first) // EACH
    times = STEP * (batch + 1.0)
    return STEP / EACH * np.arange(n), times + (0.0 if late is None else late[batch])


def spread(stamps: Array, cuts: tuple[int, ...] = ()) -> Array:
    clock, edges = SpreadTimes(RowBatch(STEP, EACH)), [0, *sorted(cuts), len(stamps)]
    pieces = [stamps[a:b] for a, b in zip(edges, edges[1:], strict=False)]
    return np.concatenate([clock.of(piece) for piece in pieces])


@given(st.integers(1, EACH), st.integers(30, 200))
def test_even_batches_are_even_times_though_the_first_is_cut_off(
    first: int, n: int
) -> None:
    taken, stamps = stamped(n, first)
    np.testing.assert_allclose(np.diff(spread(stamps)), np.diff(taken), atol=1e-9)


@given(st.lists(st.integers(20, 180), max_size=5))
def test_it_is_no_matter_how_the_rows_come(cuts: list[int]) -> None:
    _, stamps = stamped(200)
    np.testing.assert_allclose(spread(stamps, tuple(cuts)), spread(stamps), atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_batches_that_come_late_move_rows_little(seed: int) -> None:
    late = np.random.default_rng(seed).uniform(0, 0.4 * STEP, 60)
    taken, stamps = stamped(500, late=late)
    found = spread(stamps)
    assert (np.diff(found) > 0).all()
    assert np.abs(np.diff(found - taken)).max() < 0.3 * STEP / EACH


def test_behind_a_pause_it_goes_on_with_the_clock() -> None:
    taken, stamps = stamped(200)
    pause = 7.0 * (np.arange(200) >= 100)
    found = spread(stamps + pause)
    np.testing.assert_allclose(np.diff(found), np.diff(taken + pause), atol=1e-9)


def test_a_row_without_a_time_has_none() -> None:
    _, stamps = stamped(60)
    stamps[33] = np.nan
    found = spread(stamps)
    assert np.isnan(found[33]) and np.isfinite(np.delete(found, 33)).all()
