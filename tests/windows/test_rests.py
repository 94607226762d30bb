"""Which cells are at rest, against slow sums and trying all thresholds."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.windows import rests


def rows_of(seed: int, m: int = 150) -> Array:
    """Rows of `cell_rows`, in some of which values are few or missing."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((m, 35))
    rows[:, 0] = np.arange(m) / 10
    counts = rng.choice([10.0, 10.0, 10.0, 5.0, 4.0, 0.0], (m, 6)) * np.arange(1, 7)
    rows[:, 1:7], rows[:, 7:13] = counts, counts * rng.normal(size=(m, 6))
    return rows


@pytest.mark.parametrize("m", [10, 11, 25, 26, 150])
def test_spans_are_spreads_and_means_of_a_second(
    monkeypatch: pytest.MonkeyPatch, m: int
) -> None:
    monkeypatch.setattr(rests, "_PART", 16)
    rows, usual = rows_of(m, m), 10.0 * np.arange(1, 7)
    last, means = np.zeros(6), []
    for row in rows:
        mean = row[7:13] / np.maximum(row[1:7], 1.0)
        last = np.where(row[1:7] >= usual / 2, mean, last)
        means.append(last)
    parts = list(rests._spans(rows, rests._TypicalCells(usual, np.inf, np.zeros(6))))
    assert [first for first, _, _ in parts] == list(range(0, m - 9, 16))
    spread, level = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    assert len(spread) == len(level) == m - 9
    for i in range(m - 9):
        np.testing.assert_allclose(spread[i], np.std(means[i : i + 10], axis=0))
        np.testing.assert_allclose(level[i], np.mean(means[i : i + 10], axis=0))


@pytest.mark.parametrize("sample", [40, 1 << 15])
def test_what_is_usual_is_the_median_of_evenly_spread_cells(
    monkeypatch: pytest.MonkeyPatch, sample: int
) -> None:
    monkeypatch.setattr(rests, "_PART", 17)
    monkeypatch.setattr(rests, "_SAMPLE", sample)
    rows = rows_of(3)
    rows[:, 1:7] = np.arange(150)[:, None] ** 2 * np.arange(1, 7)
    every = 4 if sample == 40 else 1
    expected = np.median(rows[::every, 1:7], axis=0)
    rows[:, 0] = 0.1 * np.arange(150) + 7.0 * (np.arange(150) >= 75)
    usual = rests._typical_cells(rows)
    np.testing.assert_array_equal(usual.counts, expected)
    assert usual.pause == pytest.approx(1.0)
    rows[:, 0] *= 10
    assert rests._typical_cells(rows).pause == pytest.approx(5.0)


@pytest.mark.parametrize("at", [1, 15, 16, 17, 140, 149])
def test_no_span_goes_over_a_pause(monkeypatch: pytest.MonkeyPatch, at: int) -> None:
    monkeypatch.setattr(rests, "_PART", 16)
    rows = rows_of(4)
    rows[:, 0] = 0.1 * np.arange(150) + 1.5 * (np.arange(150) >= at)
    parts = rests._spans(rows, rests._typical_cells(rows))
    spread = np.concatenate([spread for _, spread, _ in parts])
    over = [i < at <= i + 9 for i in range(141)]
    np.testing.assert_array_equal(np.isinf(spread).all(axis=1), over)
    np.testing.assert_array_equal(np.isinf(spread).any(axis=1), over)


def test_the_valley_leaves_the_least_variance_on_both_sides() -> None:
    """Otsu 1979: by trying all thresholds."""
    rng = np.random.default_rng(10)
    for few, apart in ((30, 3.0), (200, 1.5), (400, 2.0)):
        logs = np.sort(np.r_[rng.normal(0, 0.4, 300), rng.normal(apart, 0.3, few)])
        within = [
            k * logs[:k].var() + (len(logs) - k) * logs[k:].var()
            for k in range(1, len(logs))
        ]
        k = 1 + int(np.argmin(within))
        expected = np.exp((logs[:k].mean() + logs[k:].mean()) / 2)
        shuffled = np.exp(rng.permutation(logs))
        assert rests._splitting_threshold(shuffled) == pytest.approx(expected)
    assert np.isfinite(rests._splitting_threshold(np.array([0.0, 1.0, 1.0, 2.0])))


def test_a_weighted_median_counts_each_value_so_many_times() -> None:
    rng = np.random.default_rng(11)
    for n in (1, 2, 9, 10):
        values, weights = rng.normal(size=(n, 3)), rng.integers(1, 30, n)
        every = np.sort(np.repeat(values, weights, axis=0), axis=0)
        lower = every[(len(every) - 1) // 2]
        found = rests._weighted_median(values, weights)
        np.testing.assert_array_equal(found, lower)


def test_what_is_not_known_counts_nothing() -> None:
    values = np.array([[1.0, np.nan], [5.0, np.nan], [np.nan, np.nan]])
    found = rests._weighted_median(values, np.array([1, 3, 9]))
    np.testing.assert_array_equal(found, [5.0, np.nan])
    np.testing.assert_array_equal(rests._median_of_known(values), [3.0, np.nan])
    known = np.isfinite(values)
    np.testing.assert_allclose(rests._lower_decile(values, known), [1.4, 0.0])


@pytest.mark.parametrize("longest", [7, 36_000])
def test_calm_runs_go_on_from_part_to_part_up_to_the_longest(
    monkeypatch: pytest.MonkeyPatch, longest: int
) -> None:
    monkeypatch.setattr(rests, "_LONGEST", longest)
    rng = np.random.default_rng(12)
    spread, level = rng.random((400, 6)) ** 8, rng.random((400, 6))
    bound = np.full(6, 0.6)
    parts = [(k, spread[k : k + 5], level[k : k + 5]) for k in range(0, 400, 5)]
    calm = (spread < bound).all(axis=1)
    found = list(rests._calm_runs(parts, bound))
    covered = np.zeros(400, dtype=bool)
    for first, s, x in found:
        rows = slice(first, first + len(s))
        assert len(s) <= longest and not covered[rows].any()
        covered[rows] = True
        np.testing.assert_array_equal(s, spread[rows])
        np.testing.assert_array_equal(x, level[rows])
    np.testing.assert_array_equal(covered, calm)
    ends = np.flatnonzero(np.diff(calm.astype(int), prepend=0, append=0))
    if longest > 400:
        assert [first for first, _, _ in found] == ends[::2].tolist()
    else:
        # what a part adds is taken whole or begins a run of its own
        for (first, s, _), (then, t, _) in itertools.pairwise(found):
            if first + len(s) == then:
                assert len(s) + min(len(t), 5 - then % 5) > longest
