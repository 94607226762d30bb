"""Which cells of a recording are at rest, on a table or in a hand.

    s_i = sd(y over 1 s about i),   r_i = max over channels of s_i / s_low         (1)

y are the means of cells i, and s_low is the lower decile of s over the recording. log r
has two clusters, rest and turns, which are split by a threshold (Otsu 1979). Each run
of cells below it is then compared with its own noise and with the gyroscopes' level at
rest. A run ends at a pause of the recording, since the device may move during it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, runs_of_true
from fieldcal.windows.cells import CELL, CellRows, CellTable, fill_with_previous

SPREAD_CELLS = 10
"""Cells whose spread tells rest from motion: 1 s."""

_LEAST, _MOST = 4.0, 64.0
"""Bounds of the threshold, in multiples of the quietest spread: a recording may have
no turn."""

_OWN = 4.0
"""Largest spread within a stretch, in multiples of its usual one."""

_FLIPS = 0.6
"""Spread of the cell means of a coarse output that changes between two values,
steps."""

_LONGEST = 36_000
"""Cells of the longest run, an hour: a longer rest is evaluated in several parts."""

_PART = 4096
"""Spans evaluated together, to limit memory."""

_SAMPLE = 1 << 15
"""Most spans from which usual values are taken, evenly spread over the recording."""

PAUSES = 5.0
"""Least length of a pause, in usual distances between cells, and at least a span."""

_RATE = 0.02
"""Least difference from the gyroscopes' rate at rest that is a rotation, rad/s."""

SpanSpreads = tuple[int, Array, Array]
"""First of some spans, the spread and the mean of each, (k, 6).

Where a channel has no value, its spread is 0 and its mean is nan."""


class RestRun(NamedTuple):
    """Spans [first, last) at rest, and the median rate there, (3,) rad/s or nan."""

    first: int
    last: int
    rate: Array


def cell_table(rows: Array, origin: Array) -> CellTable:
    """Cells from the rows of `stretches.cell_rows`."""
    return CellTable(rows[:, 0], rows[:, 1:], origin)


def cell_index(rows: CellRows, t: float) -> int:
    """Index of the cell that contains an instant: the last that begins no later."""
    low, high = 0, len(rows) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if rows[middle : middle + 1][0, 0] <= t + CELL * 1e-3:
            low = middle
        else:
            high = middle - 1
    return low


class _TypicalCells(NamedTuple):
    """Usual values of the cells of a recording.

    Attributes
    ----------
    counts : (6,) values in a cell
    pause : shortest time between cells that is a pause, s
    flips : (6,) spread of an output that flips between two steps

    """

    counts: Array
    pause: float
    flips: Array


def _spans(rows: CellRows, usual: _TypicalCells) -> Iterator[SpanSpreads]:
    """Spread and mean of the spans of each part, with the index of its first span.

    The mean of a cell with few values is replaced by that of the cell before. Unlike
    `CellTable.steady_means` this is correct for a device that is turned, since no line
    passes through all of its positions. The spread over a pause is infinite.
    """
    before: Array = np.zeros((1, 6))
    for first in range(0, len(rows) - SPREAD_CELLS + 1, _PART):
        part = rows[first : first + _PART + SPREAD_CELLS - 1]
        cells = cell_table(part, np.zeros(6))
        means = fill_with_previous(
            np.where(cells.counts < usual.counts / 2, np.nan, cells.means), before
        )
        before = means[_PART - 1 : _PART]
        view = np.lib.stride_tricks.sliding_window_view(means, SPREAD_CELLS, axis=0)
        spread = view.std(axis=-1)
        paused = np.concatenate([[0], np.cumsum(np.diff(cells.times) > usual.pause)])
        spread[paused[SPREAD_CELLS - 1 :] > paused[: len(spread)]] = np.inf
        known = np.lib.stride_tricks.sliding_window_view(
            cells.counts > 0, SPREAD_CELLS, axis=0
        ).any(axis=-1)
        yield (
            first,
            np.where(known | np.isinf(spread), spread, 0.0),
            np.where(known, view.mean(axis=-1), np.nan),
        )


def _typical_cells(rows: CellRows) -> _TypicalCells:
    """Usual values of the cells, by their medians."""
    every = -(-len(rows) // _SAMPLE)
    counts, steps = [], []
    finest = np.full(6, np.inf)
    for first in range(0, len(rows), _PART):
        part = rows[first : first + _PART]
        finest = np.minimum(finest, part[:, 27:33].min(axis=0))
        counts.append(part[-first % every :: every, 1:7].copy())
        steps.append(np.diff(part[:, 0])[-first % every :: every])
    pause = PAUSES * max(
        float(np.median(np.concatenate(steps))), SPREAD_CELLS * CELL / PAUSES
    )
    flips = _FLIPS * np.where(np.isfinite(finest), finest, 0.0)
    return _TypicalCells(np.median(np.concatenate(counts), axis=0), pause, flips)


def find_rest_runs(rows: CellRows, bound: Array) -> list[RestRun]:
    """Runs of spans that are at rest by (1), by their own noise and by their rate.

    `bound` (6,) is the largest spread at rest of any device.
    """
    usual = _typical_cells(rows)
    every = -(-len(rows) // _SAMPLE)
    # all spans of a long recording do not fit into memory: they are calculated twice
    short = list(_spans(rows, usual)) if len(rows) <= _PART else []
    sampled = np.concatenate(
        [
            np.stack([spread, level])[:, -first % every :: every].copy()
            for first, spread, level in short or _spans(rows, usual)
        ],
        axis=1,
    )
    sampled, levels = sampled[:, np.isfinite(sampled[0]).all(axis=1)]
    if not len(sampled):
        return []
    quiet = _lower_decile(sampled, np.isfinite(levels))
    scale = np.where(quiet > 0, quiet, np.inf)
    valley = np.clip(_splitting_threshold((sampled / scale).max(axis=1)), _LEAST, _MOST)
    kept: list[RestRun] = []
    spans = short or _spans(rows, usual)
    least = np.maximum(np.minimum(valley * scale, bound), usual.flips)
    for first, spread, level in _calm_runs(spans, least):
        own = np.maximum(np.quantile(spread, 0.3, axis=0), quiet)
        own = np.maximum(own, usual.flips / _OWN)
        own = np.where(own > 0, own, np.inf)
        for a, b in runs_of_true(np.all(spread < _OWN * own, axis=1)):
            rate = _median_of_known(level[a:b, 3:])
            kept.append(RestRun(first + a, first + b, rate))
    if not kept:
        return []
    rates = np.array([run.rate for run in kept])
    rest = _weighted_median(rates, np.array([run.last - run.first for run in kept]))
    turning = np.nan_to_num(np.abs(rates - rest)).max(axis=1) > _RATE
    return [run for run, turns in zip(kept, turning, strict=True) if not turns]


def _calm_runs(spans: Iterable[SpanSpreads], bound: Array) -> Iterator[SpanSpreads]:
    """Runs of at most `_LONGEST` spans whose spread is below `bound` (6,).

    Yields the first span of each run, and spread and mean of its spans, (k, 6).
    """
    waiting: list[tuple[Array, Array]] = []
    began = length = 0
    for first, spread, level in spans:
        for a, b in runs_of_true(np.all(spread < bound, axis=1)):
            goes_on = began + length == first + a and length + b - a <= _LONGEST
            if waiting and not goes_on:
                yield began, *_concatenate(waiting)
                waiting = []
            if not waiting:
                began, length = first + a, 0
            waiting.append((spread[a:b], level[a:b]))
            length += b - a
    if waiting:
        yield began, *_concatenate(waiting)


def _concatenate(parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    spreads, levels = zip(*parts, strict=True)
    return np.concatenate(spreads), np.concatenate(levels)


def _lower_decile(values: Array, known: NDArray[np.bool_]) -> Array:
    """Lower decile of each column of `values` (n, c) where known; 0 where nowhere."""
    columns = zip(values.T, known.T, strict=True)
    return np.array([np.quantile(x[k], 0.1) if k.any() else 0.0 for x, k in columns])


def _median_of_known(values: Array) -> Array:
    """Median of each column of `values` (n, c); nan where none is known."""
    known = np.isfinite(values).any(axis=0)
    return np.where(known, np.nanmedian(np.where(known, values, 0.0), axis=0), np.nan)


def _weighted_median(values: Array, weights: Any) -> Array:
    """Median of each column of `values` (n, c), each counted `weights` (n,) times.

    What is nan counts nothing.
    """
    order = np.argsort(values, axis=0)
    counted = np.isfinite(values) * np.asarray(weights)[:, None]
    total = np.cumsum(np.take_along_axis(counted, order, axis=0), axis=0)
    middle = (2 * total < total[-1]).sum(axis=0)
    place = np.take_along_axis(order, middle[None], axis=0)
    median: Array = np.take_along_axis(values, place, axis=0)[0]
    return median


def _splitting_threshold(ratio: Array) -> float:
    """Threshold that best splits the logarithms of `ratio` into two clusters."""
    logs = np.sort(np.log(np.maximum(ratio, 1e-3)))
    n = np.arange(1, len(logs))
    below = np.cumsum(logs)[:-1] / n
    above = (logs.sum() - n * below) / (len(logs) - n)
    between_clusters = n * (len(logs) - n) * (above - below) ** 2
    k = int(np.argmax(between_clusters))
    return float(np.exp((below[k] + above[k]) / 2))
