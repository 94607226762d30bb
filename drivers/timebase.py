"""Timebase: gives each sample its time; here from a declared rate.

    t_k = k / rate, k counting also the samples known to be missing             (1)

If a device that runs in real time is silent for more than `LEAST_PAUSE`, and does not
send the samples of that time afterwards, the time of the host is added. All in s; k
sample number. `StampTimebase` and `ArrivalTimebase` are alternatives; `ChosenTimebase`
selects one of them.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Protocol

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.driver import LinkHealth

LEAST_PAUSE = 1.0
"""Least time between arrivals that is no jitter, s."""

BUFFERED_TIME = 0.05
"""Time within which buffered samples arrive, s."""

RATE_TOLERANCE = 0.2
"""Relative difference from the declared rate up to which a device runs in real time."""

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

    def link_broken(self) -> None:
        """Note that the link was interrupted before the next sample."""


class RateTimebase:
    """Times from a declared rate, (1).

    Parameters
    ----------
    health : where gaps and missing samples are counted
    rate : Hz

    """

    def __init__(self, health: LinkHealth, rate: float) -> None:
        self._health, self._period = health, 1.0 / rate
        self._base, self._k = 0.0, -1
        self._host = self._host0 = _NAN
        self._broken = False

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,); the host's time bridges an interruption of the link."""
        if self._broken:
            self._mend(float(t_host[0]))
        pauses = np.flatnonzero(
            np.diff(t_host, prepend=self._host) > LEAST_PAUSE
        ).tolist()
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
        """Add the missing time, if the samples of a pause were not merely buffered."""
        told, seen = self._k * self._period, self._host - self._host0
        if not (seen > LEAST_PAUSE and abs(told / seen - 1) < RATE_TOLERANCE):
            return  # not in real time: arrivals give no information
        came = np.sum(steps[t_host < t_host[0] + BUFFERED_TIME]) * self._period
        waited = max(0.0, float(came) - BUFFERED_TIME)
        away = float(t_host[0]) - self._host
        if waited < away / 2:
            self._health.missing += round((away - waited) / self._period) - 1
            self._mend(float(t_host[0]))

    def link_broken(self) -> None:
        """Note that a gap precedes the next sample."""
        self._broken = self._k >= 0

    def _mend(self, host: float) -> None:
        away = host - self._host
        self._base += self._k * self._period + max(self._period, away or 0.0)
        self._k, self._broken = -1, False
        self._health.gaps += 1
