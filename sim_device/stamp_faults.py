"""Faults of the device's clock: what it stamps its samples with.

The clock that a sample shows is  s = s0 + (t - t0)(1 + d)  of the device's time t, with
a drift d that can be changed, and s0 = 0 where the device has begun anew; its counter
begins anew as well. Duplicate stamps: of the next 2n samples every second shows what
the one before it showed, as an autopilot does above the rate of its loop. Late stamps:
of the next 2n samples every pair is sent the wrong way round.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Block

PPM = 1e-6


class StampFaults:
    """Clock and sample counter of one device, with their faults."""

    def __init__(self) -> None:
        self._t0 = self._s0 = self._seq0 = self._drift = 0.0
        self._restart = math.inf
        self._doubled = self._swapped = 0

    def reboot(self, at: float) -> None:
        """Begin anew at 0 with the first sample at or after `at`, s of device time."""
        self._restart = at

    def drift(self, now: float, ppm: float) -> None:
        """Run fast by so much from `now` on, s of device time."""
        self._s0, self._t0 = self._shown(now), now
        self._drift = PPM * ppm

    def duplicate(self, count: int) -> None:
        """Have so many of the next samples show the stamp of the one before."""
        self._doubled += 2 * count

    def swap(self, count: int) -> None:
        """Have so many of the next samples come behind the one after."""
        self._swapped += 2 * count

    def passes(self, block: Block) -> Block:
        """Return the samples as the device shows them."""
        if not len(block):
            return block
        if block.t[0] >= self._restart:
            self._s0, self._t0 = 0.0, float(block.t[0])
            self._seq0, self._restart = float(block.seq[0]), math.inf
        t = self._s0 + (block.t - self._t0) * (1 + self._drift)
        shown = replace(block, t=t, seq=block.seq - self._seq0)
        return self._reordered(self._repeated(shown))

    def _shown(self, t: float) -> float:
        return self._s0 + (t - self._t0) * (1 + self._drift)

    def _repeated(self, block: Block) -> Block:
        some = min(self._doubled, len(block)) // 2 * 2
        if not some:
            return block
        self._doubled -= some
        t = block.t.copy()
        t[1:some:2] = t[0:some:2]
        return replace(block, t=t)

    def _reordered(self, block: Block) -> Block:
        some = min(self._swapped, len(block)) // 2 * 2
        if not some:
            return block
        self._swapped -= some
        order = np.arange(len(block))
        order[0:some:2], order[1:some:2] = order[1:some:2], order[0:some:2].copy()
        columns = (block.acc, block.gyr, block.temperature, block.seq, block.t_host)
        return Block.of(block.t[order], *(column[order] for column in columns))
