"""Times of rows that share those of their batch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array
from fieldcal.importing.read_options import ReadOptions, RowBatch
from fieldcal.importing.tables.column_times import split_seconds
from fieldcal.importing.times.row_times import (
    BETWEEN,
    BatchTimes,
    CoarseTimes,
    RowTimes,
)

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
    clock, edges = BatchTimes(RowBatch(STEP, EACH)), [0, *sorted(cuts), len(stamps)]
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


@given(st.lists(st.integers(0, 2), max_size=60), st.lists(st.integers(0, 60)))
def test_rows_between_two_steps_of_a_clock_are_in_order(
    steps: list[int], cuts: list[int]
) -> None:
    stamps = np.cumsum([0, *steps]) * STEP
    edges = [0, *sorted(min(cut, len(stamps)) for cut in cuts), len(stamps)]
    clock = CoarseTimes(STEP)
    pieces = [clock.of(stamps[a:b]) for a, b in zip(edges, edges[1:], strict=False)]
    found = np.concatenate(pieces)
    np.testing.assert_array_equal(found, CoarseTimes(STEP).of(stamps))
    late = found - stamps
    assert (late >= 0).all() and (late <= STEP).all()
    assert (np.diff(found) >= 0).all()


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


@pytest.mark.parametrize("cut", [0, 40, 61, 75])
def test_the_clock_of_a_device_that_was_started_again_goes_on(cut: int) -> None:
    """Twice; whatever passed meanwhile, the rows behind are 10 s later."""
    each = 0.04 + 0.02 * np.arange(60)
    clock = RowTimes(ReadOptions(("t",), time_unit="s"))
    t = np.concatenate([179.3 + each, each, each + 0.5])
    parts = [t[:cut], t[cut:]] if cut else [t]
    got = np.concatenate([clock.of({"t": part}, len(part)) for part in parts])
    steps = np.diff(got)
    assert np.flatnonzero(steps > 1).tolist() == [59, 119]
    np.testing.assert_allclose(steps[[59, 119]], BETWEEN)
    assert len(clock.says) == 1 and "(and once more)" in clock.says[0]


def test_a_time_that_steps_back_for_another_reason_stays() -> None:
    """One row alone, and a clock that is set back to where no start is."""
    for odd in ([0.0], 100.0 + 0.02 * np.arange(60)):
        t = np.concatenate([200 + 0.02 * np.arange(60), odd, [202.0, 202.02]])
        clock = RowTimes(ReadOptions(("t",), time_unit="s"))
        np.testing.assert_array_equal(clock.of({"t": t}, len(t)), t)
        assert not clock.says


@pytest.mark.parametrize("cut", [0, 99, 100, 101, 102])
def test_a_time_that_leaps_ahead_within_the_first_seconds_begins_nothing_anew(
    cut: int,
) -> None:
    """The rows behind keep their times; the wrong one is left out by whoever judges."""
    t = 0.01 * np.arange(400)
    t[100] = 1e6
    clock = RowTimes(ReadOptions(("t",), time_unit="s"))
    parts = [t[:cut], t[cut:]] if cut else [t]
    got = np.concatenate([clock.of({"t": part}, len(part)) for part in parts])
    np.testing.assert_array_equal(got, t)
    assert not clock.says


@pytest.mark.parametrize("unit", ["s", "ms", "us"])
@pytest.mark.parametrize("bits", [24, 32])
def test_a_counter_of_us_goes_on_whatever_it_is_divided_by(
    unit: str, bits: int
) -> None:
    counts = np.arange(2**bits - 500_000, 2**bits + 500_000, 10_000)
    written = counts % 2**bits / {"s": 1e6, "ms": 1e3, "us": 1.0}[unit]
    times = RowTimes(ReadOptions(columns=("t",), time_unit=unit))
    t = np.concatenate([times.of({"t": one}, 25) for one in np.split(written, 4)])
    np.testing.assert_allclose(np.diff(t), 0.01, atol=1e-6)
    assert ["go on" in said for said in times.says] == [True]


def read(t: Array, cuts: tuple[int, ...]) -> tuple[Array, list[str]]:
    """Times of rows that come in pieces, and what is said of them."""
    times = RowTimes(ReadOptions(columns=("t",)))
    found = [times.of({"t": one}, len(one)) for one in np.split(t, cuts)]
    return np.concatenate(found), times.says


@pytest.mark.parametrize("cut", [40, 60, 61, 62])
def test_one_wrong_time_is_no_start_wherever_a_piece_ends(cut: int) -> None:
    t = 500.0 + np.arange(120) / 10
    t[60] = 5.0
    found, says = read(t, (cut,))
    np.testing.assert_array_equal(np.delete(found, 60), np.delete(t, 60))
    assert not says
    assert not 506.0 < found[60] < 506.1  # whoever judges rows leaves it out


@pytest.mark.parametrize("cut", [40, 60, 61, 62])
def test_a_start_is_one_wherever_a_piece_ends(cut: int) -> None:
    t = 1.7e9 + np.arange(120) / 10
    t[60:] += 0.5 - t[60]
    found, says = read(t, (cut,))
    np.testing.assert_allclose(np.diff(found)[59], BETWEEN, atol=1e-3)
    np.testing.assert_allclose(np.delete(np.diff(found), 59), 0.1, atol=1e-3)
    assert [said.partition(",")[0] for said in says] == [
        "its clock begins anew 5.9 s behind its first row"
    ]


def test_a_clock_that_ends_often_is_said_once() -> None:
    t = np.arange(0, 600, 0.5) % 60
    found, says = read(t, (100, 250))
    np.testing.assert_allclose(np.diff(found), 0.5)
    assert len(says) == 1


def test_frames_and_their_parts_are_no_seconds() -> None:
    """Parts of a frame are counted as well, but end long before a second does."""
    i = np.arange(400.0)
    assert split_seconds(np.column_stack([i // 20, i % 20]), [0]) is None
    clock = np.column_stack([i // 20, 50 * (i % 20)])
    assert split_seconds(clock, [0]) == (0, 1, "t_ms")
