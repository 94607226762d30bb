"""Whether the device has come to rest, before a window begins.

The means of the last second are compared with one another: at rest they differ by no
more than the device's own noise, which is the smallest seen so far.
"""

from __future__ import annotations

import numpy as np

from fieldcal.samples import Array, Block
from fieldcal.windows.cells import CELL, Cells
from fieldcal.windows.limits import Limits

SETTLE = 8
"""Cells that must agree before the device is called still."""

TIMES = 6.0
"""Spread, in multiples of the quietest seen, that still is rest."""


class Stillness:
    """Watch a stream and say whether the device is at rest.

    Attributes
    ----------
    meter : present motion as part of what is allowed; below 1 is still
    since : device time from which on it has been at rest, s; None while it moves

    """

    def __init__(self, limits: Limits | None = None) -> None:
        self._limits = limits or Limits()
        self._cells = Cells()
        self._seen = 0
        self._quiet: Array = np.full(6, np.inf)
        self.meter = np.inf
        self.since: float | None = None

    @property
    def still(self) -> bool:
        """Whether the device is at rest now."""
        return self.since is not None

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        self._cells.add(block)
        complete = len(self._cells) - 1
        while self._seen < complete:
            self._seen += 1
            self._judge(self._seen)

    def _judge(self, end: int) -> None:
        if end < SETTLE:
            return
        means = self._cells.means[end - SETTLE : end]
        short = self._cells.short[end - SETTLE : end]
        if np.isnan(means).all():
            return
        noise = np.sqrt(np.nan_to_num(short).mean(axis=0))
        self._quiet = np.minimum(self._quiet, np.where(noise > 0, noise, np.inf))
        spread = np.nan_to_num(np.ptp(np.nan_to_num(means), axis=0))
        allowed = np.minimum(TIMES * np.nan_to_num(self._quiet), self._limits.noise)
        self.meter = float(np.max(spread / np.where(allowed > 0, allowed, np.inf)))
        if self.meter > 1:
            self.since = None
        elif self.since is None:
            self.since = float(self._cells.times[end - SETTLE] + CELL)
