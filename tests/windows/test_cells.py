"""Cells of 0.1 s against sums over the samples of each."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcal.core.samples import Array, Block
from fieldcal.windows import cells
from fieldcal.windows.cells import (
    CellAccumulator,
    CellTable,
    fill_with_previous,
    resolution,
)


def block(n: int = 400, seed: int = 0, lost: float = 0.1) -> Block:
    """Samples at 60 a second in steps of 1/8, some of them and of the values lost."""
    rng = np.random.default_rng(seed)
    t = 50.0 + np.arange(n) / 60
    six = np.round(rng.normal(size=(n, 6)) * 8) / 8 + [0, -9.75, 0, 0.25, 0, 0]
    six[rng.random((n, 6)) < lost] = np.nan
    six[rng.random((n, 6)) < lost / 10] = np.inf
    kept = rng.random(n) > lost
    warm = np.where(rng.random(n) < 0.5, 20 + t / 100, np.nan)
    kept[0] = True
    return Block.of(t[kept], six[kept, :3], six[kept, 3:], warm[kept])


def filled(samples: Block) -> CellAccumulator:
    out = CellAccumulator()
    out.add(samples)
    return out


def by_hand(samples: Block) -> dict[int, list[int]]:
    """Samples of each cell."""
    rows: dict[int, list[int]] = {}
    for i, t in enumerate(samples.t - samples.t[0]):
        rows.setdefault(int(t * 10 + 1e-5), []).append(i)
    return rows


def test_a_cell_holds_what_its_samples_say() -> None:
    samples = block()
    table, six = (
        filled(samples).table,
        np.where(np.isinf(samples.six), np.nan, samples.six),
    )
    rows = by_hand(samples)
    assert len(table) == len(rows) == table.sums.shape[0]
    step = np.vstack([np.full(6, np.nan), np.diff(six, axis=0)])
    for cell, (index, some) in enumerate(rows.items()):
        assert table.times[cell] == pytest.approx(50.0 + 0.1 * index)
        x, d = six[some], step[some]
        known, moved = np.isfinite(x).sum(axis=0), np.isfinite(d).sum(axis=0)
        np.testing.assert_array_equal(table.counts[cell], known)
        np.testing.assert_array_equal(table.step_counts[cell], moved)
        for c in range(6):
            if known[c]:
                mean = table.origin[c] + table.means[cell, c]
                assert mean == pytest.approx(np.nanmean(x[:, c]))
            else:
                assert np.isnan(table.means[cell, c])
            if moved[c]:
                assert table.short_lag_variance[cell, c] == pytest.approx(
                    np.nanmean(d[:, c] ** 2) / 2
                )
            else:
                assert np.isnan(table.short_lag_variance[cell, c])
            changes = np.abs(d[:, c])
            finest = np.min(changes[changes > 0], initial=np.inf)
            assert table.smallest_changes[cell, c] == finest


def test_the_whole_of_a_table_is_that_of_its_samples() -> None:
    samples = block()
    made = filled(samples)
    table, six = made.table, np.where(np.isinf(samples.six), np.nan, samples.six)
    assert (made.n, made.start, made.end) == (
        len(samples),
        samples.t[0],
        samples.t[-1],
    )
    np.testing.assert_allclose(table.mean, np.nanmean(six, axis=0))
    first = np.isfinite(six).argmax(axis=0)
    np.testing.assert_array_equal(table.origin, six[first, np.arange(6)])
    noise = np.sqrt(np.nanmean(np.diff(six, axis=0) ** 2, axis=0) / 2)
    np.testing.assert_allclose(table.noise, noise)
    assert table.temperature == pytest.approx(np.nanmean(samples.temperature))
    np.testing.assert_array_equal(table.resolution, np.full(6, 0.125))
    assert table.span == (samples.t[0], samples.t[-1])
    assert table.period == 0.1
    assert table.seconds == pytest.approx(0.1 * len(table))
    # the noise hides steps this fine
    assert not table.rounding.any()


def test_what_was_never_measured_is_nan_and_has_no_step() -> None:
    samples = block(lost=0.0)
    samples = Block.of(samples.t, samples.acc)
    table = filled(samples).table
    assert np.isnan(table.mean[3:]).all() and np.isnan(table.noise[3:]).all()
    assert np.isnan(table.temperature)
    np.testing.assert_array_equal(table.resolution, [0.125] * 3 + [0.0] * 3)
    assert np.isfinite(table.mean[:3]).all()


def test_nothing_yet_is_an_empty_table() -> None:
    nothing = CellAccumulator()
    assert nothing.n == 0 and np.isnan([nothing.start, nothing.end]).all()
    assert len(nothing.table) == 0 and nothing.table.complete_count == 0
    assert np.isnan(nothing.table.mean).all() and not nothing.table.resolution.any()
    assert len(nothing.take_complete()) == 0


def assert_same(one: CellTable, other: CellTable) -> None:
    np.testing.assert_allclose(one.times, other.times, rtol=1e-12)
    np.testing.assert_allclose(one.sums, other.sums, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(one.origin, other.origin)


@settings(max_examples=20)
@given(cuts=st.lists(st.integers(0, 1000), max_size=8), seed=st.integers(0, 20))
def test_how_samples_come_does_not_matter(cuts: list[int], seed: int) -> None:
    samples = block(1000, seed)
    edges = [0, *sorted(min(c, len(samples)) for c in cuts), len(samples)]
    pieces = CellAccumulator()
    for a, b in zip(edges, edges[1:], strict=False):
        pieces.add(samples[a:b])
    assert_same(pieces.table, filled(samples).table)
    assert pieces.n == len(samples)


def test_long_blocks_are_summed_in_parts_and_short_ones_added_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    samples = block(1000)
    whole = filled(samples).table
    monkeypatch.setattr(cells, "_CHUNK", 17)
    assert_same(filled(samples).table, whole)


def test_cells_are_handed_over_once_and_the_last_is_kept() -> None:
    samples = block(600)
    made, taken = CellAccumulator(), []
    for a in range(0, len(samples), 25):
        made.add(samples[a : a + 25])
        taken.append(made.take_complete())
        assert len(made.table) == 1
    whole = filled(samples).table
    tables = [*taken, made.table]
    times = np.concatenate([table.times for table in tables])
    sums = np.vstack([table.sums for table in tables])
    assert_same(CellTable(times, sums, whole.origin), whole)


def test_a_time_that_misses_its_edge_by_rounding_lies_in_its_cell() -> None:
    t = 1e5 + np.arange(600) / 100
    table = filled(Block.of(t, np.ones((600, 3)))).table
    np.testing.assert_array_equal(table.counts[:, 0], np.full(60, 10))


def table_of(counts: Array, means: Array) -> CellTable:
    """A table of c channels' counts and means, (m, 6)."""
    sums = np.zeros((len(counts), 34))
    sums[:, :6], sums[:, 6:12] = counts, counts * np.nan_to_num(means)
    return CellTable(np.arange(len(counts)) / 10, sums, np.zeros(6))


def test_cells_that_are_alike_stay_as_they_are() -> None:
    means = np.random.default_rng(0).normal(size=(40, 6))
    table = table_of(np.full((40, 6), 10.0), means)
    np.testing.assert_array_equal(table.steady_means, table.means)


def test_a_cell_with_few_values_is_drawn_to_the_line_of_the_others() -> None:
    """So far that it varies as much as the others: by the root of its share."""
    line = np.arange(240)[:, None] * np.full(6, 0.01)
    means, counts = line.copy(), np.full((240, 6), 10.0)
    means[100] += 1.0
    counts[100, 0], counts[100, 1], counts[100, 2], counts[100, 3] = 2.5, 0, 20, 5
    found = table_of(counts, means).steady_means - line
    expected = np.zeros((240, 6))
    expected[100] = [0.5, 0.0, 1.0, np.sqrt(0.5), 1.0, 1.0]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_channel_that_has_no_values_is_steady_at_none() -> None:
    counts = np.full((40, 6), 10.0)
    counts[:, 4] = 0
    found = table_of(counts, np.ones((40, 6))).steady_means
    np.testing.assert_allclose(found, np.where(np.arange(6) == 4, 0.0, 1.0) + 0 * found)


@pytest.mark.parametrize(("last", "whole"), [(10, 8), (9, 8), (8.9, 7), (1, 7)])
def test_the_last_cell_counts_once_it_is_filled(last: float, whole: int) -> None:
    counts = np.full((8, 6), 10.0)
    counts[-1] = last
    counts[:, 5] = 0.0
    assert table_of(counts, np.ones((8, 6))).complete_count == whole
    assert table_of(counts[-1:], np.ones((1, 6))).complete_count == 1


def test_cells_begin_at_the_first_sample_or_not() -> None:
    samples = block(60, lost=0.0)
    table = filled(samples).table
    assert table.starts_on_edge
    later = CellTable(table.times - 0.01, table.sums, table.origin)
    assert (
        not later.starts_on_edge
        and not CellTable(table.times + 6e-7, table.sums, table.origin).starts_on_edge
    )


def test_the_resolution_is_the_finest_of_the_sensor() -> None:
    found = resolution(np.array([0.5, 0.25, np.inf, np.inf, np.inf, np.inf]))
    np.testing.assert_array_equal(found, [0.25] * 3 + [0.0] * 3)


def test_coarse_steps_show() -> None:
    t = np.arange(100) / 100
    acc = np.zeros((100, 3))
    acc[::20] = 1.0
    table = filled(Block.of(t, acc)).table
    np.testing.assert_array_equal(table.rounding, [1, 1, 1, 0, 0, 0])


def test_a_missing_mean_is_the_one_before() -> None:
    nan = np.nan
    means = np.array([[nan, 1.0], [2.0, nan], [nan, nan], [3.0, 4.0]])
    np.testing.assert_array_equal(
        fill_with_previous(means), [[0, 1], [2, 1], [2, 1], [3, 4]]
    )
    before = np.array([[7.0, 8.0]])
    expected = [[7, 1], [2, 1], [2, 1], [3, 4]]
    np.testing.assert_array_equal(fill_with_previous(means, before), expected)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
@pytest.mark.parametrize("rate", [2.0, 5.0, 7.0, 10.0, 14.0, 100.0])
def test_cells_last_as_long_as_the_samples_in_them(rate: float, jitter: float) -> None:
    """Below 10 Hz a cell holds one sample, or none; a pause is no time of a sample."""
    rng = np.random.default_rng(4)
    t = np.arange(round(40 * rate)) / rate
    t += jitter / rate * rng.uniform(-1, 1, len(t))
    t[len(t) // 2 :] += 60.0
    cells = CellAccumulator()
    cells.add(Block.of(t, rng.standard_normal((len(t), 3))))
    assert cells.table.seconds == pytest.approx(40.0, rel=0.02)
    assert cells.table.period == pytest.approx(max(0.1, 1 / rate), rel=0.15)


@pytest.mark.parametrize(
    ("at", "left"),
    [(52.05, 20), (52.0, 20), (51.99, 19), (50.05, 0), (53.0, 30), (60.0, 30)],
)
def test_cells_that_end_after_an_instant_are_cut_off(at: float, left: int) -> None:
    """As if the samples behind had not come; those that follow begin cells anew."""
    t = 50.0 + 0.01 * np.arange(300)
    six = np.random.default_rng(2).normal(size=(300, 6))
    samples = Block.of(t, six[:, :3], six[:, 3:])
    found = filled(samples)
    found.truncate(at)
    assert len(found.table) == left and found.n == 10 * left
    last = 50.0 + 0.1 * left - 0.01
    assert found.end == pytest.approx(last if left else 50.0)
    if left:
        assert_same(found.table, filled(samples[: 10 * left]).table)
