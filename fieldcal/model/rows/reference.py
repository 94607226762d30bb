"""A reference of the device's motion, interpolated, and filtered as a sensor does.

A sensor with a delay d and a time constant tau puts out for an input u

    y(t) = int_0^inf u(t - d - tau a) exp(-a) da,                tau >= 0         (1)
    y(t) = u(t - d) - tau u'(t - d),                             tau < 0          (2)

which is a low-pass of first order, or the inverse of one in the reference. The integral
is evaluated by Gauss-Laguerre quadrature, exact for polynomials of degree 2 NODES - 1.
With the operator D = d/dt, (1) has the derivative

    dy / dtau = -D (1 + |tau| D)^-1 y                                             (3)

which for tau = 0 equals the derivative by the delay. If |tau| is below `LEAST`, `LEAST`
replaces it in (3); t is the difference of the two. The effect that distinguishes a time
constant from a delay is proportional to its square. A step by (3) from tau to tau'
therefore gives a squared time constant of

    tau |tau| + (|tau| + t) (tau' - tau)                                          (4)

Units: s, m/s^2, rad/s; axes of the reference. Source: first-order lag; Abramowitz and
Stegun 25.4.45.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fieldcal.core.samples import Array, Block, Index

GAP = 3.5
"""Intervals between samples from which there is a gap."""

FEWEST = 8
"""Samples of a channel from which a reference has it."""

NODES = 5
"""Of the sum in place of (1)."""

LEAST = 2e-3
"""Time constant that hardly a motion of a body tells from a delay, s."""


class Reference:
    """What a reference says between its samples, by cubic splines.

    Parameters
    ----------
    block : its samples; a channel that it has not is taken as 0

    Attributes
    ----------
    observed : (6,) channels that it has
    start, end : s of its clock
    splines : of the channels that it has, those with the same samples as one, with the
        channels' numbers

    """

    def __init__(self, block: Block) -> None:
        six = block.six
        self.observed = np.isfinite(six).sum(axis=0) >= FEWEST
        whole = np.isfinite(six[:, self.observed]).any(axis=1)
        self.t, self.step = block.t[whole], float(np.median(np.diff(block.t[whole])))
        self.start, self.end = float(self.t[0]), float(self.t[-1])
        self.splines = [
            (channels, CubicSpline(block.t[known], six[np.ix_(known, channels)]))
            for known, channels in self._by_missing_samples(np.isfinite(six))
        ]

    def _by_missing_samples(
        self, finite: NDArray[np.bool_]
    ) -> Iterator[tuple[NDArray[np.bool_], Index]]:
        """Samples (n,), and the channels that it has of which these are known."""
        alike: dict[bytes, list[int]] = {}
        for c in np.flatnonzero(self.observed).tolist():
            alike.setdefault(finite[:, c].tobytes(), []).append(c)
        for channels in alike.values():
            yield finite[:, channels[0]], np.array(channels)

    @property
    def lost(self) -> Index:
        """Channels that it lacks of triads of which it has some."""
        some = np.repeat(self.observed.reshape(2, 3).any(axis=1), 3)
        return np.flatnonzero(some & ~self.observed)

    def at(self, s: Array, order: int = 0) -> Array:
        """The six channels, or a derivative, at instants of its clock, (n, 6)."""
        out = np.zeros((len(s), 6))
        for channels, spline in self.splines:
            out[:, channels] = spline(s, order)
        return out

    def followed(self, tau: float) -> Self:
        """What a sensor with a time constant makes of it, s, (1) and (2)."""
        if tau == 0:
            return self
        out = copy(self)
        out.splines = [
            (channels, CubicSpline(spline.x, _lagging(spline, tau)))
            for channels, spline in self.splines
        ]
        return out

    def covers(self, s: Array, margin: float) -> NDArray[np.bool_]:
        """Instants about which it has samples, and so far beyond, s."""
        inside = (s > self.start + margin) & (s < self.end - margin)
        after = np.clip(np.searchsorted(self.t, s), 1, len(self.t) - 1)
        return inside & (self.t[after] - self.t[after - 1] < GAP * self.step)


def _lagging(spline: CubicSpline, tau: float) -> Array:
    """Values (n, k) at the knots of a spline of k channels as a sensor follows it."""
    t = spline.x
    if tau < 0:
        early: Array = spline(t) - tau * spline(t, 1)  # (2)
        return early
    ages, weights = np.polynomial.laguerre.laggauss(NODES)
    late: Array = sum(
        weight * spline(np.maximum(t - tau * age, t[0]))  # (1)
        for age, weight in zip(ages, weights, strict=True)
    )
    return late


@dataclass(frozen=True, slots=True)
class Response:
    """What the sensors of a triad make of the motion.

    Attributes
    ----------
    late : s by which they are late
    tau : time constant with which they follow, s
    sensed : the motion so followed
    slower : that once more, as the slope (3) is of

    """

    late: float
    tau: float
    sensed: Reference
    slower: Reference

    @classmethod
    def of(cls, reference: Reference, late: float = 0.0, tau: float = 0.0) -> Self:
        """Of sensors that follow a reference."""
        sensed = reference.followed(tau)
        return cls(late, tau, sensed, sensed.followed(max(abs(tau), LEAST)))  # (3)

    def towards(self, reference: Reference, late: float, tau: float) -> Self:
        """What a step of (3) from here to a delay and a time constant, s, comes to.

        The time constant is the one of (4), or none; of what that is less, the sensors
        are the later.
        """
        now, there = self.tau, 0.0
        if tau:
            square = now * abs(now)
            square += (abs(now) + max(abs(now), LEAST)) * (tau - now)  # (4)
            there = float(np.sign(square) * np.sqrt(abs(square)))
        late += tau - there
        if there == now:
            return replace(self, late=late)
        return self.of(reference, late, there)
