"""Still stretches of a recording that nobody marked.

    r_i = max over channels of sd(y over 1 s about i) / quietest tenth of them     (1)

y are cell means. Rest and turns make two heaps of log r; the valley between them (Otsu
1979) tells one from the other, be the rest on a table or in a hand. Each stretch is
then held to its own noise, to the level of the gyroscopes at rest, and to the test that
a window must pass, so that no sample of a turn gets in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from fieldcal.samples import Array, Block
from fieldcal.windows.cells import CELL, Cells, Table
from fieldcal.windows.limits import Limits
from fieldcal.windows.verdict import judge

_SPAN = 10
"""Cells whose spread tells rest from motion: 1 s."""

_LEAST, _MOST = 4.0, 64.0
"""Bounds on the valley, in multiples of the quietest: a recording may have no turn."""

_OWN = 4.0
"""Spread, in multiples of what is usual in a stretch, that still belongs to it."""

_LONGEST = 36_000
"""Cells of the longest stretch, an hour: a longer rest is several of them."""

_PART = 4096
"""Spans looked at together: all of them at once would take ten times their memory."""

_RATE = 0.02
"""Difference from the level of the gyroscopes at rest that is a rotation, rad/s."""

Runs = list[tuple[int, int]]


Between = Callable[[float, float], Iterable[Block]]
"""Samples from a time up to another, s, in order, in blocks."""


def still_stretches(
    block: Block, min_seconds: float = 2.0, limits: Limits | None = None
) -> list[tuple[float, float]]:
    """Find where the device was still, (start, end) in s of device time, in order.

    Every stretch lasts `min_seconds`, at least 1 s, an hour at most, and passes
    `average`.
    """

    def between(start: float, end: float) -> list[Block]:
        return [block.between(start, end)]

    return still_in(_cells([block]), between, min_seconds, limits)


def still_in(
    cells: Table,
    between: Between,
    min_seconds: float = 2.0,
    limits: Limits | None = None,
) -> list[tuple[float, float]]:
    """`still_stretches` of a recording that does not fit into memory.

    Parameters
    ----------
    cells : of all of it
    between : gives the samples of a stretch of it
    min_seconds, limits : as in `still_stretches`

    """
    if len(cells) < 2 * _SPAN:
        return []
    means = cells.level
    view = np.lib.stride_tricks.sliding_window_view(means, _SPAN, axis=0)
    parts = [view[i : i + _PART] for i in range(0, len(view), _PART)]
    spread = np.concatenate([part.std(axis=-1) for part in parts])
    level = np.concatenate([part.mean(axis=-1) for part in parts])
    shortest = max(1.0, min_seconds)
    found: list[tuple[float, float]] = []
    limits = limits or Limits()
    for first, last in _at_rest(spread, level, limits.noise):
        for cut in range(first, last, _LONGEST):
            start = float(cells.times[cut + _SPAN // 2])
            end = float(cells.times[min(cut + _LONGEST, last - 1) + _SPAN // 2])
            found += _passing(between, start, end, shortest, limits)
    return found


def _at_rest(spread: Array, level: Array, bound: Array) -> Runs:
    """Runs of spans, [first, last), at rest by (1), by their own noise and rate.

    `bound` (6,) is what no spread at rest exceeds.
    """
    quiet = np.quantile(spread, 0.1, axis=0)
    scale = np.where(quiet > 0, quiet, np.inf)
    ratio = (spread / scale).max(axis=1)
    valley = np.clip(_valley(ratio), _LEAST, _MOST)
    kept: Runs = []
    for first, last in _runs((ratio < valley) & (spread < bound).all(axis=1)):
        own = np.maximum(np.quantile(spread[first:last], 0.3, axis=0), quiet)
        own = np.where(own > 0, own, np.inf)
        calm = (spread[first:last] < _OWN * own).all(axis=1)
        kept += [(first + a, first + b) for a, b in _runs(calm)]
    if not kept:
        return []
    rates = np.array([np.median(level[a:b, 3:], axis=0) for a, b in kept])
    weights = np.array([b - a for a, b in kept])
    rest = np.median(np.repeat(rates, weights, axis=0), axis=0)
    turning = np.nan_to_num(np.abs(rates - rest)).max(axis=1) > _RATE
    return [run for run, turns in zip(kept, turning, strict=True) if not turns]


def _valley(ratio: Array) -> float:
    """Threshold that splits the logarithms of `ratio` into two heaps best."""
    logs = np.sort(np.log(np.maximum(ratio, 1e-3)))
    n = np.arange(1, len(logs))
    below = np.cumsum(logs)[:-1] / n
    above = (logs.sum() - n * below) / (len(logs) - n)
    between = n * (len(logs) - n) * (above - below) ** 2
    k = int(np.argmax(between))
    return float(np.exp((below[k] + above[k]) / 2))


def _passing(
    between: Between, start: float, end: float, shortest: float, limits: Limits
) -> list[tuple[float, float]]:
    """Parts of a stretch that pass as windows: it is cut where it was disturbed."""
    sums, times = Cells(), [np.nan, np.nan]
    for block in between(start, end):
        if len(block):
            sums.add(block)
            times = [np.fmin(times[0], block.t[0]), block.t[-1]]
    first, last = float(times[0]), float(times[1])
    if not last - first >= shortest:
        return []
    worst = judge(sums.table, limits).worst
    if worst.ratio <= 1:
        return [(first, float(np.nextafter(last, np.inf)))]
    after = max(worst.at + worst.seconds, first + CELL)
    return [
        *_passing(between, start, min(worst.at, end), shortest, limits),
        *_passing(between, max(after, start), end, shortest, limits),
    ]


def _cells(blocks: Iterable[Block]) -> Table:
    cells = Cells()
    for block in blocks:
        cells.add(block)
    return cells.table


def _runs(flags: Any) -> Runs:
    edges = np.flatnonzero(np.diff(flags.astype(int), prepend=0, append=0))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
