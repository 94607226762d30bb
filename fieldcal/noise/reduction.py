"""Reduces samples, as they come, to stretches with powers, in constant memory.

Samples count as evenly spaced, as a device takes them: lost ones make a stretch
shorter, and its samples no rarer, since white noise is that of a sample times its
interval. A new stretch begins after a gap of a second or more, or of `GAP_STEPS`
samples of a slow device, and where the level changes at a disturbance.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.noise.disturbed import bridge_disturbances
from fieldcal.noise.levels import CosineLevels, ReducedStretch

MIN_GAP_S = 1.0
"""Time without samples that begins a new stretch, s."""

GAP_STEPS = 2.5
"""Usual intervals of a slow device that make a gap."""

FIRST_STEPS = 16
"""Intervals that show which are usual."""

LOST_STEPS = 1.5
"""Mean intervals beyond which samples were lost in between."""

MOST_LOST, MOST_UNEVEN = 0.5, 0.15
"""Largest share of the time that may be lost, and relative scatter of the intervals of
a device that shows it: times of arrival have such intervals as well, and none is
missing."""

ROWS = 1 << 17
"""Samples that are processed together."""

CHANNELS = 6


@dataclass(frozen=True, slots=True)
class Reduction:
    """A reduced recording, as input of `CosineSpectrum`.

    Attributes
    ----------
    stretches : reduced, columns: six channels and the thermometer
    known : (6,) whether a channel was measured
    has_temperature : whether a temperature was measured
    samples, bridged : number of samples, and of those that were disturbed and replaced
    start, end : first and last time, s

    """

    stretches: tuple[ReducedStretch, ...]
    known: Array
    has_temperature: bool
    samples: int
    bridged: int
    start: float
    end: float


class Reducer:
    """Reduces the samples of one recording."""

    def __init__(self) -> None:
        self._done: list[ReducedStretch] = []
        self._levels: CosineLevels | None = None
        self._waiting: list[Block] = []
        self._held: Array = np.empty((0, CHANNELS + 1))
        self._cell_dt = np.nan
        self._rows = self._samples = self._bridged = 0
        self._last = self._first = np.nan
        self._gap_s = np.nan
        self._steps, self._stepped, self._span = 0, 0.0, (np.nan, np.nan)
        self._known = np.zeros(CHANNELS, dtype=bool)
        self._value = np.full(CHANNELS + 1, np.nan)

    def add(self, block: Block) -> None:
        """Take samples, in order of time; those without any value count as lost."""
        blank = ~np.isfinite(block.six).any(axis=1)
        if blank.any():
            block = block[np.flatnonzero(~blank)]
        if not len(block):
            return
        if np.isnan(self._gap_s) and len(block) > 2:
            usual = float(np.median(np.diff(block.t[: FIRST_STEPS + 1])))
            self._gap_s = max(MIN_GAP_S, GAP_STEPS * usual)
        longest = np.fmax(self._gap_s, MIN_GAP_S)
        edges = np.flatnonzero(np.diff(block.t, prepend=self._last) > longest)
        first = 0
        for edge in [*edges.tolist(), len(block)]:
            if edge > first:
                self._take(block[first:edge])
            if edge < len(block):
                self._flush(last=True)
                self._end()
            first = edge
        self._last = float(block.t[-1])

    def reduction(self) -> Reduction:
        """Return the reduction of all samples so far."""
        self._flush(last=True)
        self._end()
        return Reduction(
            tuple(self._done),
            self._known,
            bool(np.isfinite(self._value[CHANNELS])),
            self._samples,
            self._bridged,
            *self._span,
        )

    def _take(self, block: Block) -> None:
        self._waiting.append(block)
        self._rows += len(block)
        self._samples += len(block)
        self._span = (float(np.fmin(self._span[0], block.t[0])), float(block.t[-1]))
        while self._rows >= ROWS:
            self._flush(last=False)

    def _flush(self, last: bool) -> None:
        """Process waiting samples: `ROWS` of them, or all if they are the last ones.

        Pieces of equal length make the result independent of the lengths of blocks.
        """
        t, rows = self._next(self._rows if last else ROWS)
        if len(t) > 1:
            steps = intervals_without_losses(np.diff(t))
            self._steps += len(steps)
            self._stepped += float(steps.sum())
        if not self._steps:
            return
        if np.isnan(self._cell_dt):
            self._cell_dt = self._stepped / self._steps
        held = np.concatenate([self._held, self._filled(rows)])
        found, self._held = bridge_disturbances(held, self._cell_dt, CHANNELS, last)
        for calm in found:
            if calm.begins:
                self._end(keep=True)
            if self._levels is None:
                self._levels = CosineLevels(1.0, CHANNELS + 1, CHANNELS)
            self._levels.add(calm.rows)
            self._bridged += calm.bridged

    def _next(self, count: int) -> tuple[Array, Array]:
        """Take the first of the waiting samples: times (n,) and values (n, 7)."""
        taken: list[Block] = []
        while count:
            block = self._waiting.pop(0)
            if len(block) > count:
                self._waiting.insert(0, block[count:])
                block = block[:count]
            taken.append(block)
            count -= len(block)
            self._rows -= len(block)
        t = np.concatenate([np.empty(0), *(b.t for b in taken)])
        rows = [np.column_stack([b.acc, b.gyr, b.temperature]) for b in taken]
        return t, np.concatenate([np.empty((0, CHANNELS + 1)), *rows])

    def _filled(self, rows: Array) -> Array:
        """Replace missing values by the last known one; 0 if there is none."""
        # by column, which is faster than along rows of seven
        if not len(rows):
            return rows
        missing = np.ascontiguousarray(~np.isfinite(rows).T)
        found = np.logical_not(missing.all(axis=1))
        self._known |= found[:CHANNELS]
        for c in np.flatnonzero(missing.any(axis=1)):
            good = np.flatnonzero(~missing[c])
            if not len(good):
                rows[:, c] = np.nan_to_num(self._value[c])
                continue
            if np.isnan(self._value[c]):
                self._value[c] = rows[good[0], c]
            place = np.searchsorted(good, np.arange(len(rows)), side="right") - 1
            rows[:, c] = np.where(place < 0, self._value[c], rows[good[place], c])
        self._value[found] = rows[-1, found]
        return rows

    def _end(self, keep: bool = False) -> None:
        """End a stretch."""
        if self._levels is not None:
            dt = self._stepped / self._steps
            self._done.append(replace(self._levels.reduced(), dt=dt))
        self._levels = None
        if not keep:
            self._steps, self._stepped, self._cell_dt = 0, 0.0, np.nan


def intervals_without_losses(steps: Array) -> Array:
    """Intervals between samples, s, without those in which others were lost.

    >>> intervals_without_losses(np.array([0.1, 0.1, 0.4, 0.1, 0.1])).tolist()
    [0.1, 0.1, 0.1, 0.1]
    """
    kept = steps
    while len(less := steps[steps <= LOST_STEPS * kept.mean()]) < len(kept):
        kept = less
    lost = steps.sum() - len(steps) * kept.mean()
    even = kept.std() <= MOST_UNEVEN * kept.mean()
    return kept if even and lost <= MOST_LOST * steps.sum() else steps


def reduce_recording(blocks: Iterable[Block]) -> Reduction:
    """Reduce a recording of a device at rest, block by block."""
    reducer = Reducer()
    for block in blocks:
        reducer.add(block)
    return reducer.reduction()
