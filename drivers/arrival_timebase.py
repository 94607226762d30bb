"""Timebase of a device that has no clock and no declared rate, from arrivals.

Sample k is sent at a + kT and arrives some time later. Samples arrive in batches, and
only the last of a batch gives a time. The arrivals z are regressed on the
sample number, forgetting slowly:

    x = (a + kT, T),  F(m) = [[1, m], [0, 1]],  z = x_1 + v                 (1)
    P <- F P F' e^(mT/M);  K = P h / (h'P h + R);  x <- F x + K (z - x_1)   (2)

m samples since the last batch, h = (1, 0), R the variance of the delays, M the memory.
The result is x_1: evenly spaced times, late by the mean delay, without the jitter of
the arrivals. If all arrivals are late for `LATE_TIME` seconds, samples were lost;
before that a delay is assumed. The samples of the first `LEARNING_TIME` seconds get no
time.

Source: recursive least squares with forgetting, Haykin, Adaptive Filter Theory, ch. 10.
All in s. It holds for a device that runs in real time.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, sqrt

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.drivers.driver import LinkHealth

LEARNING_TIME = 1.0
"""Duration of the first regression, s."""

LEAST_BATCHES = 8
"""Least number of batches in the first regression."""

LEAST_NOISE = 1e-8
"""Least variance of the delays, s^2."""

LATE_TIME = 0.5
"""Time after which late arrivals mean lost samples, s."""

MEMORY_TIME = 100.0
"""Memory of the regression, s."""


class ArrivalTimebase:
    """Times regressed on the arrivals, (1), (2).

    Parameters
    ----------
    health : where gaps and missing samples are counted

    """

    def __init__(self, health: LinkHealth) -> None:
        self._health = health
        self._k = 0
        self._lessons: list[tuple[int, float]] = []
        self._x = self._period = float("nan")
        self._cov = (0.0, 0.0, 0.0)
        self._noise = 0.0
        self._t = float("nan")
        self._late: list[tuple[float, float]] = []
        self._broken = False

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,) on the host's clock, nan until the rate is estimated."""
        self._health.gaps += int(np.sum(steps > 1))
        self._health.missing += int(np.sum(steps - 1))
        parts = []
        for batch, z in _split_by_arrival(steps, t_host):
            if np.isnan(self._t) or np.isnan(z):
                self._learn(int(batch.sum()), z)
                parts.append(np.full(len(batch), np.nan))
            else:
                parts.append(self._batch(batch, z))
        return np.concatenate(parts)

    def link_broken(self) -> None:
        """Note that a gap precedes the next sample."""
        self._broken = True

    def _learn(self, m: int, z: float) -> None:
        if self._broken:
            self._lessons, self._broken = [], False
        self._k += m
        if np.isnan(z):
            return
        self._lessons.append((self._k, z))
        k, arrival = np.array(self._lessons).T
        if len(k) < LEAST_BATCHES or arrival[-1] - arrival[0] < LEARNING_TIME:
            return
        design = np.column_stack([np.ones(len(k)), k - k[-1]])
        (x, period), square, *_ = np.linalg.lstsq(design, arrival)
        self._noise = max(float(square.sum()) / (len(k) - 2), LEAST_NOISE)
        cov = self._noise * np.linalg.inv(design.T @ design)
        self._x, self._period = float(x), float(period)
        self._cov = (float(cov[0, 0]), float(cov[0, 1]), float(cov[1, 1]))
        self._t = self._x

    def _batch(self, steps: Array, z: float) -> Array:
        m = float(steps.sum())
        self._predict(m)
        lost = self._weigh(z)
        if lost:
            self._x += lost * self._period
            self._health.gaps += 1
            self._health.missing += lost
            behind = np.cumsum(steps[::-1])[::-1] - steps
            t: Array = self._x - behind * self._period
        else:
            # between the two estimates, so that times never decrease
            ahead = max(self._x - self._t, 0.1 * m * self._period)
            t = self._t + ahead * np.cumsum(steps) / m
        self._t = float(t[-1])
        return t

    def _predict(self, m: float) -> None:
        """Predict by m samples, (1), with forgetting, (2)."""
        a, b, c = self._cov
        forget = exp(m * self._period / MEMORY_TIME)
        self._x += m * self._period
        self._cov = (
            (a + 2 * m * b + m * m * c) * forget,
            (b + m * c) * forget,
            c * forget,
        )

    def _weigh(self, z: float) -> int:
        """Correct the estimate by an arrival, (2); return how many were lost."""
        error, (a, b, c) = z - self._x, self._cov
        spread = a + self._noise
        if error > max(6 * sqrt(spread), 1.5 * self._period):
            self._late.append((z, error))
            if not self._broken and z - self._late[0][0] < LATE_TIME:
                return 0
            lost = round(min(e for _, e in self._late) / self._period)
            self._late, self._broken = [], False
            return lost
        self._late, self._broken = [], False
        self._x += a / spread * error  # (2)
        self._period += b / spread * error
        self._cov = (a - a * a / spread, b - a * b / spread, c - b * b / spread)
        self._noise += 0.02 * (min(error**2, 9 * spread) - self._noise)
        self._noise = max(self._noise, LEAST_NOISE)
        return 0


def _split_by_arrival(steps: Array, t_host: Array) -> Iterator[tuple[Array, float]]:
    """Split into batches of equal arrival time."""
    cuts = np.flatnonzero(np.diff(t_host)) + 1
    if not len(cuts):  # as a link that is read in time gives them
        yield steps, float(t_host[-1])
        return
    for batch, host in zip(np.split(steps, cuts), np.split(t_host, cuts), strict=True):
        yield batch, float(host[-1])
