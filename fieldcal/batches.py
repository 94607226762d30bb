"""Samples that a device hands over several at a time: the time of each.

A FIFO of n samples is read at t_j, the time of its newest. While nothing is lost its
samples lie evenly between two readings,

    t_jk = t_j-1 + (t_j - t_j-1) k / n,    k = 1 .. n                            (1)

so that a clock of the sensor that is a little off bends no time. Behind a gap, where
t_j - t_j-1 is longer than n and a half periods d as the device tells it,

    t_jk = t_j - (n - k) d                                                       (2)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.samples import Array

GAP = 1.5
"""Times the length of a batch that lie between two, if something is missing."""


class Fifo:
    """Gives every sample of a FIFO its time, reading by reading."""

    def __init__(self) -> None:
        self._last = np.nan

    def times(self, read: Array, number: NDArray[np.int64], period: Array) -> Array:
        """Times of all samples, (sum of `number`,) s, in order.

        Parameters
        ----------
        read : (m,) s, time of the newest sample of each reading
        number : (m,) samples of each, at least 1
        period : (m,) s, time between samples as the device tells it

        """
        before = np.concatenate([[self._last], read[:-1]])
        away = read - before
        even = (away > 0) & (away < GAP * number * period)
        step = np.where(even, away / number, period)  # (1), (2)
        self._last = float(read[-1])
        first = np.cumsum(number) - number
        k = np.arange(number.sum()) - np.repeat(first - 1, number)
        late = np.repeat(number, number) - k
        times: Array = np.repeat(read, number) - late * np.repeat(step, number)
        return times
