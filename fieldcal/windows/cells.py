"""Samples summed into cells of 0.1 s of device time, block by block.

A cell c holds, for each channel, the number of values n_c, their sum S_c about an
origin, and the sum D_c of m_c squared differences of successive values. From these

    y_c = S_c / n_c                    mean of the cell
    q_c = D_c / (2 m_c)                variance of the short-lag noise in the cell

are all that the mean, its error and the stillness of a window are judged by, so that
the cost of judging does not depend on the sample rate and the result does not depend
on how the samples were cut into blocks. A nan is a missing value: it enters neither
sum. Device axes, SI.
"""

from __future__ import annotations

import numpy as np

from fieldcal.samples import Array, Block
from fieldcal.windows.trend import line

CELL = 0.1
"""Length of a cell, s."""

_CHUNK = 8192
"""Samples summed at a time, so that what is in hand stays in the processor's cache."""

_GRACE = 1e-5
"""Part of a cell by which a time may miss its edge through rounding."""


class Cells:
    """Cells of one stretch of samples, in time order; empty cells are left out.

    Attributes
    ----------
    n : samples taken in
    start, end : first and last instant, s of device time; nan before the first sample
    origin : (6,) what the sums are taken about: the first value of each channel
    finest : (6,) smallest change from one value to the next but none, SI

    """

    def __init__(self) -> None:
        self.n = 0
        self.start = self.end = np.nan
        self.origin = np.full(6, np.nan)
        self.finest = np.full(6, np.inf)
        self._last = np.full((1, 6), np.nan)
        self._size = 0
        self._index = np.zeros(64, dtype=np.int64)
        self._sums = np.zeros((64, 26))

    def __len__(self) -> int:
        return self._size

    def add(self, block: Block) -> None:
        """Take in the samples of a block that follows the last one."""
        for first in range(0, len(block), _CHUNK):
            self._add(block[first : first + _CHUNK])

    def _add(self, block: Block) -> None:
        x = self._centred(block)
        if not self.n:
            self.start = float(block.t[0])
        self.n += len(block)
        self.end = float(block.t[-1])
        step = np.diff(np.vstack([self._last, x]), axis=0)
        self._last = x[-1:]
        size = np.abs(step)
        self.finest = np.fmin(self.finest, np.where(size > 0, size, np.inf).min(axis=0))
        index = np.floor((block.t - self.start) / CELL + _GRACE).astype(np.int64)
        self._accumulate(index, _rows(x, step, block.temperature))

    def _centred(self, block: Block) -> Array:
        six = np.where(np.isfinite(block.six), block.six, np.nan)
        for channel in np.flatnonzero(np.isnan(self.origin)):
            known = np.flatnonzero(~np.isnan(six[:, channel]))
            if known.size:
                self.origin[channel] = six[known[0], channel]
        centred: Array = six - self.origin
        return centred

    def _accumulate(self, index: np.ndarray, rows: Array) -> None:
        first = np.flatnonzero(np.diff(index, prepend=index[0] - 1))
        sums = np.add.reduceat(rows, first, axis=0)
        index = index[first]
        if self._size and self._index[self._size - 1] == index[0]:
            self._sums[self._size - 1] += sums[0]
            index, sums = index[1:], sums[1:]
        end = self._size + len(index)
        while end > len(self._index):
            self._index = np.concatenate([self._index, np.zeros_like(self._index)])
            self._sums = np.concatenate([self._sums, np.zeros_like(self._sums)])
        self._index[self._size : end] = index
        self._sums[self._size : end] = sums
        self._size = end

    @property
    def times(self) -> Array:
        """Start of each cell, (m,) s of device time."""
        times: Array = self.start + CELL * self._index[: self._size]
        return times

    @property
    def counts(self) -> Array:
        """Values in each cell, (m, 6)."""
        return self._sums[: self._size, 0:6]

    @property
    def means(self) -> Array:
        """Mean of each cell less the origin, (m, 6); nan where it has no value."""
        return _ratio(self._sums[: self._size, 6:12], self.counts)

    @property
    def short(self) -> Array:
        """Variance of the short-lag noise in each cell, (m, 6); nan where unknown."""
        sums = self._sums[: self._size]
        return _ratio(sums[:, 12:18], 2 * sums[:, 18:24])

    @property
    def steady(self) -> Array:
        """Means as `means`, (m, 6), alike in variance and with none missing.

        The mean of a cell with fewer values than usual is drawn towards a line through
        the others as far as it varies more; where none is, it lies on the line.
        """
        counts, means = self.counts, self.means
        usual = np.median(counts, axis=0)
        trust = np.sqrt(np.minimum(1.0, counts / np.where(usual > 0, usual, 1.0)))
        if (trust == 1.0).all():
            return means
        laid = line(_held(means))
        steady: Array = laid + trust * np.where(counts > 0, means - laid, 0.0)
        return steady

    @property
    def whole(self) -> int:
        """Cells that are complete: all, or all but the last while it fills."""
        if self._size < 2:
            return self._size
        filled = self.counts[-1].max() >= 0.9 * np.median(self.counts.max(axis=1))
        return self._size if filled else self._size - 1

    @property
    def steps(self) -> Array:
        """Successive differences in each cell, (m, 6)."""
        return self._sums[: self._size, 18:24]

    @property
    def spacing(self) -> float:
        """Device time from one cell to the next on average, s."""
        span = self._index[self._size - 1] - self._index[0] + 1
        return float(CELL * span / self._size)

    @property
    def noise(self) -> Array:
        """Standard deviation of the short-lag noise, (6,); nan where unknown."""
        total = self._sums[: self._size].sum(axis=0)
        return np.sqrt(_ratio(total[12:18], 2 * total[18:24]))

    @property
    def resolution(self) -> Array:
        """Finest change seen on any axis of the same sensor, (6,); 0 where none."""
        finest = np.repeat(self.finest.reshape(2, 3).min(axis=1), 3)
        return np.where(np.isfinite(finest), finest, 0.0)

    @property
    def mean(self) -> Array:
        """Mean of all values, (6,); nan where not measured."""
        total = self._sums[: self._size].sum(axis=0)
        mean: Array = self.origin + _ratio(total[6:12], total[0:6])
        return mean

    @property
    def temperature(self) -> float:
        """Mean temperature, deg C; nan where unknown."""
        total = self._sums[: self._size].sum(axis=0)
        return float(_ratio(total[24:25], total[25:26])[0])


def _rows(x: Array, step: Array, temperature: Array) -> Array:
    known, moved, warm = np.isfinite(x), np.isfinite(step), np.isfinite(temperature)
    return np.column_stack(
        [
            known,
            np.where(known, x, 0.0),
            np.where(moved, step, 0.0) ** 2,
            moved,
            np.where(warm, temperature, 0.0),
            warm,
        ]
    )


def _ratio(sums: Array, counts: Array) -> Array:
    unknown = np.full(sums.shape, np.nan)
    ratio: Array = np.divide(sums, counts, out=unknown, where=counts > 0)
    return ratio


def _held(means: Array) -> Array:
    """Means with the one before where one is missing, 0 before the first."""
    known = np.isfinite(means)
    row = np.maximum.accumulate(
        np.where(known, np.arange(len(means))[:, None], 0), axis=0
    )
    return np.nan_to_num(np.take_along_axis(means, row, axis=0))
