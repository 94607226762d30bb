"""Samples that a device hands over several at a time: the time of each.

A FIFO of n samples is read at t_j, the time of its newest. While nothing is lost its
samples lie evenly between two readings,

    t_jk = t_j-1 + (t_j - t_j-1) k / n,    k = 1 .. n                            (1)

so that a clock of the sensor that is a little off bends no time. Behind a gap, where
t_j - t_j-1 is longer than n and a half periods d as the device tells it,

    t_jk = t_j - (n - k) d                                                       (2)

ArduPilot's batch sampler (ISBH, ISBD) writes whole batches of one sensor, the
accelerometer or the gyroscope, from a first time on at a steady rate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, concat
from fieldcal.importing.times.alignment import nearest_in_time

GAP_BATCHES = 1.5
"""Times the length of a batch that lie between two, if something is missing."""


class FifoTimes:
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
        even = (away > 0) & (away < GAP_BATCHES * number * period)
        step = np.where(even, away / number, period)  # (1), (2)
        self._last = float(read[-1])
        first = np.cumsum(number) - number
        k = np.arange(number.sum()) - np.repeat(first - 1, number)
        late = np.repeat(number, number) - k
        times: Array = np.repeat(read, number) - late * np.repeat(step, number)
        return times


WAITING = 8
"""Batches that may be open at once: of those that are older, a part was lost."""


@dataclass(slots=True)
class FifoBatch:
    """A batch that comes part by part.

    Attributes
    ----------
    gyro : whether of the gyroscope
    start, period : of its samples, s
    length : number of its samples
    parts : those that came, (k, 3) SI, by their number

    """

    gyro: bool
    start: float
    period: float
    length: int
    parts: dict[int, Array] = field(default_factory=dict)

    @property
    def whole(self) -> bool:
        """Whether all of it is there."""
        return sum(map(len, self.parts.values())) >= self.length

    def block(self) -> Block:
        """Its samples; those of the other sensor are unknown."""
        values = np.concatenate([self.parts[i] for i in sorted(self.parts)])
        values = values[: self.length]
        t = self.start + self.period * np.arange(len(values))
        unknown = np.full(values.shape, np.nan)
        return Block.of(t, *((unknown, values) if self.gyro else (values, unknown)))


class FifoBatches:
    """Puts the batches of one device together from their parts.

    Attributes
    ----------
    lost : batches of which a part is missing

    """

    def __init__(self) -> None:
        self._open: dict[int, FifoBatch] = {}
        self._done: tuple[bool, Block] | None = None
        self.lost = 0

    def begin(self, number: int, batch: FifoBatch) -> None:
        """Take in what a batch will be."""
        self.lost += self._open.pop(number, None) is not None
        self._open[number] = batch

    def forget(self) -> None:
        """Give up batches so old that the missing part will not come."""
        for number in list(self._open)[:-WAITING]:
            del self._open[number]
            self.lost += 1

    def feed(self, number: int, place: int, values: Array) -> Iterator[Block]:
        """Take in a part, (k, 3) SI; gives samples that no other batch goes with."""
        batch = self._open.get(number)
        if batch is None:
            return
        batch.parts[place] = values
        if not batch.whole:
            return
        del self._open[number]
        block, before = batch.block(), self._done
        self._done = (batch.gyro, block)
        if before is None:
            return
        if before[0] != batch.gyro and block.t[0] <= before[1].t[-1]:
            pair = (before[1], block) if batch.gyro else (block, before[1])
            self._done = None
            yield in_time_order(*pair)
        else:
            yield before[1]

    def rest(self) -> Iterator[Block]:
        """Give the last samples."""
        self.lost += len(self._open)
        self._open = {}
        if self._done is not None:
            yield self._done[1]
            self._done = None


def in_time_order(acc: Block, gyr: Block) -> Block:
    """Samples of two sensors in order of time.

    Each of the accelerometer goes with the gyroscope's nearest within half a period of
    either; all others stay alone, with the other sensor's values unknown.
    """
    partner, apart = nearest_in_time(acc.t, gyr.t)
    period = min(_period(acc.t), _period(gyr.t))
    first = np.concatenate([[True], np.diff(partner) != 0])
    paired = first & ~(apart > period / 2)
    rates = acc.gyr.copy()
    rates[paired] = gyr.gyr[partner[paired]]
    alone = np.ones(len(gyr), dtype=bool)
    alone[partner[paired]] = False
    both = concat([Block.of(acc.t, acc.acc, rates), _rows(gyr, alone)])
    order = np.argsort(both.t, kind="stable")
    return Block.of(both.t[order], both.acc[order], both.gyr[order])


def _period(t: Array) -> float:
    return float(np.median(np.diff(t))) if len(t) > 1 else np.inf


def _rows(block: Block, some: NDArray[np.bool_]) -> Block:
    return Block.of(block.t[some], block.acc[some], block.gyr[some])
