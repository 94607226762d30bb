"""The time of each sample: what gives it, and how from a declared rate.

    t_k = k / rate, k counting also the samples known to be missing             (1)

Where a device that has run in real time says nothing for more than `PAUSE`, and what
comes then is not the samples of that time in a heap, time goes on as the host saw it.
All in s; k sample number. `Stamps` and `Arrivals` are beside this, and `Clock` chooses.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Protocol

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.driver import Health

PAUSE = 1.0
"""Arrivals so far apart are no jitter, s."""

AT_ONCE = 0.05
"""What waited in a buffer comes within this, s."""

IN_STEP = 0.2
"""How far a device that runs in real time may be off its declared rate, relative."""

_NAN = float("nan")


class Timebase(Protocol):
    """Gives each sample its time."""

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times in s, (n,), nan for a sample to drop.

        Parameters
        ----------
        stamps : (n,) s, the device's own, nan where unknown
        steps : (n,) periods since the sample before
        t_host : (n,) s

        """

    def broken(self) -> None:
        """Take note that the link was away before the next sample."""


class Rate:
    """Times from a declared rate, (1).

    Parameters
    ----------
    health : where gaps and missing samples are counted
    rate : Hz

    """

    def __init__(self, health: Health, rate: float) -> None:
        self._health, self._period = health, 1.0 / rate
        self._base, self._k = 0.0, -1
        self._host = self._host0 = _NAN
        self._broken = False

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,); over a broken link time goes on as the host saw it."""
        if self._broken:
            self._mend(float(t_host[0]))
        pauses = np.flatnonzero(np.diff(t_host, prepend=self._host) > PAUSE).tolist()
        edges = [*dict.fromkeys([0, *pauses]), len(steps)]
        parts = []
        for begin, end in pairwise(edges):
            if begin in pauses:
                self._pause(steps[begin:], t_host[begin:])
            parts.append(self._count(steps[begin:end], t_host[begin:end]))
        return np.concatenate(parts)

    def _count(self, steps: Array, t_host: Array) -> Array:
        if self._k < 0:
            self._host0 = float(t_host[0])
        k = self._k + np.cumsum(steps)
        self._health.gaps += int(np.sum(steps > 1))
        self._health.missing += int(np.sum(steps - 1))
        self._k, self._host = int(k[-1]), float(t_host[-1])
        t: Array = self._base + k * self._period  # (1)
        return t

    def _pause(self, steps: Array, t_host: Array) -> None:
        """Tell a device that was silent from samples that only waited for us."""
        told, seen = self._k * self._period, self._host - self._host0
        if not (seen > PAUSE and abs(told / seen - 1) < IN_STEP):
            return  # it does not run in real time: arrivals say nothing of it
        came = np.sum(steps[t_host < t_host[0] + AT_ONCE]) * self._period
        waited = max(0.0, float(came) - AT_ONCE)
        away = float(t_host[0]) - self._host
        if waited < away / 2:
            self._health.missing += round((away - waited) / self._period) - 1
            self._mend(float(t_host[0]))

    def broken(self) -> None:
        """Have the next sample begin after a gap."""
        self._broken = self._k >= 0

    def _mend(self, host: float) -> None:
        away = host - self._host
        self._base += self._k * self._period + max(self._period, away or 0.0)
        self._k, self._broken = -1, False
        self._health.gaps += 1
