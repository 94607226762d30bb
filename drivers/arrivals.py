"""The time of samples of a device that has no clock and no declared rate.

Sample k is sent at a + kT and arrives some time later; batches of samples arrive
together, and only the last of a batch tells when. The arrivals z are regressed on the
sample number, forgetting slowly:

    x = (a + kT, T),  F(m) = [[1, m], [0, 1]],  z = x_1 + v                 (1)
    P <- F P F' e^(mT/M);  K = P h / (h'P h + R);  x <- F x + K (z - x_1)   (2)

m samples since the last batch, h = (1, 0), R the variance of the delays, M the memory.
What comes out is x_1, so even times late by the mean delay, not the jitter of the
arrivals. Arrivals that all stay late for `LATE` seconds mean lost samples; before that
they are taken for a delay. The samples of the first `LEARN` seconds only teach.

Source: recursive least squares with forgetting, Haykin, Adaptive Filter Theory, ch. 10.
All in s. It holds for a device that runs in real time.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.driver import Health
from fieldcal.samples import Array

LEARN = 1.0
"""Time that the first regression takes, s."""

LEAST = 8
"""Batches that the first regression takes."""

LATE = 0.5
"""Time after which late arrivals mean lost samples, s."""

MEMORY = 100.0
"""Memory of the regression, s."""


class Arrivals:
    """Times regressed on the arrivals, (1), (2).

    Parameters
    ----------
    health : where gaps and missing samples are counted

    """

    def __init__(self, health: Health) -> None:
        self._health = health
        self._k = 0
        self._lessons: list[tuple[int, float]] = []
        self._x = np.full(2, np.nan)
        self._cov = np.zeros((2, 2))
        self._noise = 0.0
        self._t = float("nan")
        self._late: list[tuple[float, float]] = []
        self._broken = False

    def times(self, stamps: Array, steps: Array, t_host: Array) -> Array:
        """Return times (n,) on the host's clock, nan while the rate is learnt."""
        parts = []
        for batch, z in _batches(steps, t_host):
            if np.isnan(self._t) or np.isnan(z):
                self._learn(int(batch.sum()), z)
                parts.append(np.full(len(batch), np.nan))
            else:
                parts.append(self._batch(batch, z))
        return np.concatenate(parts)

    def broken(self) -> None:
        """Take the next late arrival for a gap at once."""
        self._broken = True

    def _learn(self, m: int, z: float) -> None:
        if self._broken:
            self._lessons, self._broken = [], False
        self._k += m
        if np.isnan(z):
            return
        self._lessons.append((self._k, z))
        k, arrival = np.array(self._lessons).T
        if len(k) < LEAST or arrival[-1] - arrival[0] < LEARN:
            return
        design = np.column_stack([np.ones(len(k)), k - k[-1]])
        self._x, square, *_ = np.linalg.lstsq(design, arrival)
        self._noise = max(float(square.sum()) / (len(k) - 2), 1e-8)
        self._cov = self._noise * np.linalg.inv(design.T @ design)
        self._t = float(self._x[0])

    def _batch(self, steps: Array, z: float) -> Array:
        m = int(steps.sum())
        move = np.array([[1.0, m], [0.0, 1.0]])
        self._x = move @ self._x  # (1)
        forget = np.exp(m * self._x[1] / MEMORY)
        self._cov = move @ self._cov @ move.T * forget
        lost = self._weigh(z)
        if lost:
            self._x[0] += lost * self._x[1]
            self._health.gaps += 1
            self._health.missing += lost
            behind = np.cumsum(steps[::-1])[::-1] - steps
            t: Array = self._x[0] - behind * self._x[1]
        else:
            # between the two estimates, so that a correction never turns time back
            ahead = max(float(self._x[0]) - self._t, 0.1 * m * float(self._x[1]))
            t = self._t + ahead * np.cumsum(steps) / m
        self._t = float(t[-1])
        return t

    def _weigh(self, z: float) -> int:
        """Correct the estimate by an arrival, (2); return how many were lost."""
        error, period = z - float(self._x[0]), float(self._x[1])
        spread = float(self._cov[0, 0]) + self._noise
        if error > max(6 * np.sqrt(spread), 1.5 * period):
            self._late.append((z, error))
            if not self._broken and z - self._late[0][0] < LATE:
                return 0
            lost = round(min(e for _, e in self._late) / period)
            self._late, self._broken = [], False
            return lost
        self._late, self._broken = [], False
        gain = self._cov[:, 0] / spread
        self._x = self._x + gain * error  # (2)
        self._cov = self._cov - np.outer(gain, self._cov[0])
        self._noise += 0.02 * (min(error**2, 9 * spread) - self._noise)
        self._noise = max(self._noise, 1e-8)
        return 0


def _batches(steps: Array, t_host: Array) -> Iterator[tuple[Array, float]]:
    """Split where the arrival changes."""
    cuts = np.flatnonzero(np.diff(t_host)) + 1
    for batch, host in zip(np.split(steps, cuts), np.split(t_host, cuts), strict=True):
        yield batch, float(host[-1])
