"""Samples of an accelerometer and a gyroscope that have times of their own.

Each sample of the accelerometer goes with the gyroscope's nearest in time, within half
a period of the accelerometer; where there is none it stays alone. Nothing is
interpolated. What comes out does not depend on how the samples were cut into blocks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fieldcal.core.samples import Array, Block, Index, concat

MAX_WAIT_S = 10.0
"""Longest time that a sample waits for its partner, s: either sensor may end."""


class AlignedPair:
    """Pairs each accelerometer sample with the gyroscope's nearest in time.

    Attributes
    ----------
    worst : longest time between the two of a pair, s

    """

    def __init__(self) -> None:
        self._acc: list[Block] = []
        self._gyr: list[Block] = []
        self._period = np.nan
        self.worst = 0.0

    def feed(
        self, acc: Block | None, gyr: Block | None, wait: float = MAX_WAIT_S
    ) -> Block:
        """Return samples of which both sides are known, or that waited so long, s."""
        self._acc += [acc] if acc is not None else []
        self._gyr += [gyr] if gyr is not None else []
        acc_all, gyr_all = concat(self._acc), concat(self._gyr)
        until = gyr_all.t[-1] if len(gyr_all) else -np.inf
        if len(acc_all):
            until = max(until, acc_all.t[-1] - wait)
        ready = int(np.searchsorted(acc_all.t, until))
        self._acc = [acc_all[ready:]]
        out = self._paired(acc_all[:ready], gyr_all)
        if len(out):
            keep = max(0, int(np.searchsorted(gyr_all.t, out.t[-1])) - 1)
            self._gyr = [gyr_all[keep:]]
        elif len(gyr_all):
            late = int(np.searchsorted(gyr_all.t, gyr_all.t[-1] - MAX_WAIT_S))
            self._gyr = [gyr_all[late:]]
        return out

    def through(self, acc: Iterable[Block], gyr: Iterable[Block]) -> Iterator[Block]:
        """All samples of two flows, which end when they end.

        A piece of a file spans more time the slower its sensor is. So the next one is
        of the flow that is behind, and samples wait until the gyroscope has come up.
        """
        flows, newest = (iter(acc), iter(gyr)), [-np.inf, -np.inf]
        while min(newest) < np.inf:
            behind = int(newest[1] < newest[0])
            block = next(flows[behind], None)
            if block is None:
                newest[behind] = np.inf
                continue
            known = block.t[np.isfinite(block.t)]
            newest[behind] = float(np.max(known, initial=newest[behind]))
            wait = np.inf if newest[1] < np.inf else 0.0
            force, rate = (None, block) if behind else (block, None)
            yield self.feed(force, rate, wait)
        yield self.rest()

    def rest(self) -> Block:
        """Return the last samples."""
        return self._paired(concat(self._acc), concat(self._gyr))

    def _paired(self, acc: Block, gyr: Block) -> Block:
        if not len(acc):
            return acc
        if len(acc) > 1:
            self._period = float(np.median(np.diff(acc.t)))
        out = np.full((len(acc), 3), np.nan)
        if len(gyr):
            partner, apart = nearest_in_time(acc.t, gyr.t)
            close = ~(apart > self._period / 2)
            out[close] = gyr.gyr[partner[close]]
            if close.any():
                self.worst = max(self.worst, float(apart[close].max()))
        return Block.of(acc.t, acc.acc, out, acc.temperature)


def nearest_in_time(t: Array, others: Array) -> tuple[Index, Array]:
    """Which of other times (m,), in order, is nearest to each (n,), and how far."""
    right = np.searchsorted(others, t).clip(0, len(others) - 1)
    left = (right - 1).clip(0)
    nearer = np.abs(others[left] - t) <= np.abs(others[right] - t)
    found = np.where(nearer, left, right)
    return found, np.abs(others[found] - t)
