"""Samples summed into cells of 0.1 s of device time, block by block.

A cell c holds, for each channel, the number of values n_c, their sum S_c about an
origin, and the sum D_c of m_c squared differences of successive values. From these

    y_c = S_c / n_c                    mean of the cell
    q_c = D_c / (2 m_c)                variance of the short-lag noise in the cell

the mean of a window, its error and the test for rest are calculated. Their cost does
not depend on the sample rate, and their result does not depend on how the samples were
divided into blocks. A nan is a missing value and is in no sum. Device axes, SI.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block
from fieldcal.core.sampling import PAUSE_PERIODS
from fieldcal.windows.rounding import visible_steps
from fieldcal.windows.sums import channel_sums, smallest_changes, temperature_sums
from fieldcal.windows.trend import robust_lines

CELL = 0.1
"""Length of a cell, s."""

_CHUNK = 8192
"""Samples summed at a time, so that they stay in the processor's cache."""

_GRACE = 1e-5
"""Largest rounding error of the time of an edge, in lengths of a cell."""


SamplesBetween = Callable[[float, float], Iterable[Block]]
"""Samples from a time up to another, s, in order, in blocks."""


class CellRows(Protocol):
    """Start and sums of all cells of a recording, in memory or elsewhere."""

    def __len__(self) -> int:
        """Count the cells."""

    def __getitem__(self, some: slice, /) -> Array:
        """Return the cells of a slice, (k, 35): start, s, and 34 sums."""


@dataclass(frozen=True, slots=True)
class CellTable:
    """Cells in time order; empty ones are left out.

    Attributes
    ----------
    times : (m,) start of each cell, s of device time
    sums : (m, 34) n, S, D, m of the six channels, sum and number of the temperatures,
        the smallest nonzero change between successive values, the first instant, and
        the last instant with negative sign
    origin : (6,) reference of the sums: the first value of each channel

    """

    times: Array
    sums: Array
    origin: Array

    def __len__(self) -> int:
        return len(self.times)

    @property
    def with_values(self) -> CellTable:
        """The cells that hold a value."""
        filled = self.counts.any(axis=1)
        if filled.all():
            return self
        return CellTable(self.times[filled], self.sums[filled], self.origin)

    @property
    def counts(self) -> Array:
        """Values in each cell, (m, 6)."""
        return self.sums[:, 0:6]

    @property
    def means(self) -> Array:
        """Mean of each cell less the origin, (m, 6); nan where it has no value."""
        return _ratio(self.sums[:, 6:12], self.counts)

    @property
    def short_lag_variance(self) -> Array:
        """Variance of the short-lag noise in each cell, (m, 6); nan where unknown."""
        return _ratio(self.sums[:, 12:18], 2 * self.sums[:, 18:24])

    @property
    def steady_means(self) -> Array:
        """Means (m, 6) of equal variance, with none missing.

        The mean of a cell with fewer values than usual is moved towards a line through
        the others, so that its variance is as usual; a missing mean is on the line.
        """
        counts, means = self.counts, self.means
        usual = np.median(counts, axis=0)
        trust = np.sqrt(np.minimum(1.0, counts / np.where(usual > 0, usual, 1.0)))
        if (trust == 1.0).all():
            return means
        lines = robust_lines(fill_with_previous(means))
        steady: Array = lines + trust * np.where(counts > 0, means - lines, 0.0)
        return steady

    @property
    def complete_count(self) -> int:
        """Number of complete cells: all, or all but the last while it fills."""
        if len(self) < 2:
            return len(self)
        filled = self.counts[-1].max() >= 0.9 * np.median(self.counts.max(axis=1))
        return len(self) if filled else len(self) - 1

    @property
    def step_counts(self) -> Array:
        """Number of successive differences in each cell, (m, 6)."""
        return self.sums[:, 18:24]

    @property
    def period(self) -> float:
        """Device time from one cell to the next, s, without pauses.

        Cells are as far apart as samples that come less often than cells.
        """
        if len(self) < 2 or np.median(self.counts.max(axis=1)) > 1:
            return CELL
        steps = np.diff(self.times)
        usual = steps[steps <= PAUSE_PERIODS * np.median(steps)]
        return max(CELL, float(usual.mean()))

    @property
    def seconds(self) -> float:
        """Device time of which there are samples, s."""
        return self.period * len(self)

    @property
    def noise(self) -> Array:
        """Standard deviation of the short-lag noise, (6,); nan where unknown."""
        total = self.sums.sum(axis=0)
        return np.sqrt(_ratio(total[12:18], 2 * total[18:24]))

    @property
    def resolution(self) -> Array:
        """Smallest nonzero change on any axis of the same sensor, (6,); 0 if none."""
        return resolution(self.smallest_changes.min(axis=0, initial=np.inf))

    @property
    def mean(self) -> Array:
        """Mean of all values, (6,); nan where not measured."""
        total = self.sums.sum(axis=0)
        mean: Array = self.origin + _ratio(total[6:12], total[0:6])
        return mean

    @property
    def temperature(self) -> float:
        """Mean temperature, deg C; nan where unknown."""
        total = self.sums.sum(axis=0)
        return float(_ratio(total[24:25], total[25:26])[0])

    @property
    def smallest_changes(self) -> Array:
        """Smallest nonzero change of successive values in each cell, (m, 6)."""
        return self.sums[:, 26:32]

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant, s of device time."""
        return float(self.sums[0, 32]), float(-self.sums[-1, 33])

    @property
    def starts_on_edge(self) -> bool:
        """Whether its first sample lies where its first cell begins.

        Then cells that are summed from that sample on are the same.
        """
        return bool(abs(self.span[0] - self.times[0]) < _GRACE * CELL / 2)

    @property
    def rounding(self) -> Array:
        """Resolution where the noise does not hide it, (6,); 0 elsewhere."""
        return visible_steps(self.resolution, self.noise)


class CellAccumulator:
    """Sums a stream of samples into cells.

    Attributes
    ----------
    n : number of samples so far
    start, end : first and last instant, s of device time; nan before the first sample

    """

    def __init__(self) -> None:
        self.n = 0
        self.start = self.end = np.nan
        self._origin = np.full(6, np.nan)
        self._last = np.full(6, np.nan)
        self._size = 0
        self._index = np.zeros(64, dtype=np.int64)
        self._sums = np.zeros((64, 34))

    @property
    def table(self) -> CellTable:
        """The cells so far, the last one while it fills."""
        return self._table(self._size)

    def take_complete(self) -> CellTable:
        """Return the cells that are complete, and remove them."""
        done = max(0, self._size - 1)
        taken = self._table(done)
        self._index = self._index[done:].copy()
        self._sums = self._sums[done:].copy()
        self._size -= done
        return taken

    def truncate(self, at: float) -> None:
        """Remove the cells that end after an instant, s of device time."""
        edges = self.start + CELL * (self._index[: self._size] + 1)
        self._size = int(np.count_nonzero(edges <= at + _GRACE * CELL))
        kept = self._sums[: self._size]
        self.n = int(kept[:, :6].max(axis=1, initial=0.0).sum())
        self.end = float(-kept[-1, 33]) if self._size else self.start
        self._last = np.full(6, np.nan)

    def add(self, block: Block) -> None:
        """Take in the samples of a block that follows the last one."""
        for first in range(0, len(block), _CHUNK):
            self._add(block[first : first + _CHUNK])

    def _add(self, block: Block) -> None:
        x = self._centred(block)
        whole = bool(np.isfinite(x).all())
        if not whole:
            x[np.isinf(x)] = np.nan
        if not self.n:
            self.start = float(block.t[0])
        self.n += len(block)
        self.end = float(block.t[-1])
        self._last = x[:, -1]
        step = x[:, 1:] - x[:, :-1]
        index = np.floor((block.t - self.start) / CELL + _GRACE).astype(np.int64)
        first = np.flatnonzero(np.diff(index, prepend=index[0] - 1))
        sums = np.empty((len(first), 34))
        sums[:, :24] = channel_sums(x[:, 1:], step, first, whole).reshape(-1, 24)
        sums[:, 24:26] = temperature_sums(block.temperature, first)
        sums[:, 26:32] = smallest_changes(step, first)
        sums[:, 32] = block.t[first]
        sums[:, 33] = -block.t[np.append(first[1:], len(block)) - 1]
        self._append(index[first], sums)

    def _centred(self, block: Block) -> Array:
        """Values less the origin, after the last one of the block before, (6, 1 + n).

        The values of a channel are contiguous in memory, which halves the time of sums.
        """
        for channel in np.flatnonzero(np.isnan(self._origin)):
            triad = block.acc if channel < 3 else block.gyr
            known = np.flatnonzero(np.isfinite(triad[:, channel % 3]))
            if known.size:
                self._origin[channel] = triad[known[0], channel % 3]
        x = np.empty((6, 1 + len(block)))
        x[:, 0] = self._last
        np.subtract(block.acc.T, self._origin[:3, None], out=x[:3, 1:])
        np.subtract(block.gyr.T, self._origin[3:, None], out=x[3:, 1:])
        return x

    def _append(self, index: NDArray[np.int64], sums: Array) -> None:
        if self._size and self._index[self._size - 1] == index[0]:
            last = self._sums[self._size - 1]
            last[:26] += sums[0, :26]
            last[26:] = np.minimum(last[26:], sums[0, 26:])
            index, sums = index[1:], sums[1:]
        end = self._size + len(index)
        if end > len(self._index):
            most = max(end, 2 * len(self._index))
            self._index = np.resize(self._index, most)
            self._sums = np.resize(self._sums, (most, 34))
        self._index[self._size : end] = index
        self._sums[self._size : end] = sums
        self._size = end

    def _table(self, size: int) -> CellTable:
        times = self.start + CELL * self._index[:size]
        return CellTable(times, self._sums[:size], self._origin)


def join_cells(first: CellTable, later: CellTable) -> CellTable:
    """Cells of two pieces of one recording as one table, about the first's origin."""
    origin = np.where(np.isfinite(first.origin), first.origin, later.origin)
    sums = [first.sums.copy(), later.sums.copy()]
    for part, own in zip(sums, (first.origin, later.origin), strict=True):
        part[:, 6:12] += part[:, :6] * np.nan_to_num(own - origin)
    times = np.concatenate([first.times, later.times])
    return CellTable(times, np.vstack(sums), origin)


def resolution(finest: Array) -> Array:
    """Smallest change on any axis of the same sensor, (6,); 0 where there was none."""
    sensor = np.repeat(finest.reshape(2, 3).min(axis=1), 3)
    return np.where(np.isfinite(sensor), sensor, 0.0)


def _ratio(sums: Array, counts: Array) -> Array:
    unknown = np.full(sums.shape, np.nan)
    ratio: Array = np.divide(sums, counts, out=unknown, where=counts > 0)
    return ratio


def fill_with_previous(means: Array, before: Array | None = None) -> Array:
    """Means (m, c) in which a missing one is replaced by the previous one, or 0.

    Parameters
    ----------
    means : nan where missing
    before : (1, c) means of the cell before the first, none of them missing

    """
    first = np.zeros((1, means.shape[1])) if before is None else before
    means = np.vstack([first, means])
    known = np.isfinite(means)
    row = np.maximum.accumulate(
        np.where(known, np.arange(len(means))[:, None], 0), axis=0
    )
    return np.take_along_axis(means, row, axis=0)[1:]
