"""Compares the device's clock with the host's.

A sample stamped t on the device arrives at h = a + r t + delay, where the delay is at
least that of an idle line. The least h - t of each stretch of time is therefore free of
queueing, and a straight line through these minima gives the offset a and the rate r:

    h_i = a + r t_i + e_i,   least squares,   s^2 = sum(e^2) / (n - 2)      (1)

The device's clock is fast by 1/r - 1. Source: Moon, Skelly, Towsley, Estimation and
removal of clock skew from network delay measurements, INFOCOM 1999, with the line
through minima in place of their linear programme. All in s.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.driver import ClockFit, LinkHealth

FIRST_STRETCH = 1.0
"""Initial length of a stretch, s of device time."""

MOST_STRETCHES = 512
"""Stretches kept; with more, pairs are joined."""

LEAST_STRETCHES = 10
"""Least number of stretches for a fit."""


class ClockComparison:
    """Collects device times and arrivals in bounded memory.

    Parameters
    ----------
    health : gets the fit after each stretch; the fit restarts with the device's clock

    """

    def __init__(self, health: LinkHealth) -> None:
        self._health, self._restarts = health, health.restarts
        self._length = FIRST_STRETCH
        self._least: dict[int, tuple[float, float, int]] = {}

    def add(self, t: Array, t_host: Array) -> None:
        """Take device times and arrivals, (n,) each; arrivals may be unknown."""
        if not self._health.clocked:
            return
        if self._restarts != self._health.restarts:
            self._restarts, self._least = self._health.restarts, {}
        before = len(self._least)
        known = ~(np.isnan(t) | np.isnan(t_host))
        t, late = t[known], (t_host - t)[known]
        if not len(t):
            return
        stretch = np.floor(t / self._length).astype(np.int64)
        begins = np.flatnonzero(np.diff(stretch, prepend=stretch[0] - 1))
        ends = [*begins[1:].tolist(), len(t)]
        for begin, end in zip(begins.tolist(), ends, strict=True):
            i = begin + int(np.argmin(late[begin:end]))
            n = end - begin
            self._keep(int(stretch[begin]), float(t[i]), float(late[i]), n)
        begun = len(self._least) > before
        while len(self._least) > MOST_STRETCHES:
            self._coarsen()
        if begun:
            self._health.clock = self.fit()

    def _keep(self, stretch: int, t: float, late: float, n: int) -> None:
        before_t, before, count = self._least.get(stretch, (t, late, 0))
        least = (t, late) if late < before else (before_t, before)
        self._least[stretch] = (*least, count + n)

    def _coarsen(self) -> None:
        self._length *= 2
        points, self._least = list(self._least.values()), {}
        for t, late, n in points:
            self._keep(int(np.floor(t / self._length)), t, late, n)

    def fit(self) -> ClockFit | None:
        """Fit the line, (1); None before there is enough."""
        if len(self._least) < LEAST_STRETCHES:
            return None
        t, late, count = np.array(list(self._least.values())).T
        # a stretch with few samples has no reliable least delay
        full = count >= np.median(count) / 2
        t, late = t[full], late[full]
        middle = t.mean()
        design = np.column_stack([np.ones(len(t)), t - middle])
        (level, slope), square, *_ = np.linalg.lstsq(design, late)
        variance = float(square[0]) / (len(t) - 2)
        spread = float(np.sum((t - middle) ** 2))
        rate = 1.0 + float(slope)  # (1)
        sigma_rate = np.sqrt(variance / spread)
        return ClockFit(
            fast_ppm=(1 / rate - 1) * 1e6,
            sigma_ppm=float(sigma_rate / rate**2) * 1e6,
            offset_s=float(level - slope * middle),
            sigma_s=float(np.sqrt(variance / len(t) + (sigma_rate * middle) ** 2)),
        )
