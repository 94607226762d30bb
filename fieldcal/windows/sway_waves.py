"""Waves of the outputs in a window on a swaying base, and the rotation they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

POINTS = 400
"""Instants at which the rotation of a stretch is evaluated."""

PERIODS = 1.2
"""Fewest periods in a stretch: with less, waves are confused with drift, and means are
up to twenty times as far off as the fit states."""


@dataclass(frozen=True, slots=True)
class SwayWaves:
    """Swaying in a stretch of a window, as waves of the outputs.

    Attributes
    ----------
    hz : (k,) frequencies
    middle : s, origin of the phases
    cos, sin : (k, 6) amplitudes of the outputs, m/s^2 and rad/s
    force, arm : (3,) m/s^2 and m, force at rest and arm from the centre of rotation
    excess_variance : (6,) variance of the means at rest beyond that of white noise
    noise : (6,) variance of a mean over a cell of `length` s; nan without gyroscopes
    length : length of a cell, s
    span : first and last instant of the stretch, s

    """

    hz: Array
    middle: float
    cos: Array
    sin: Array
    force: Array
    arm: Array
    excess_variance: Array
    noise: Array
    length: float
    span: tuple[float, float]

    @property
    def mean_squares(self) -> tuple[float, float]:
        """Mean squares of the rotation, rad^2, and of its rate, rad^2/s^2."""
        t = np.linspace(*self.span, POINTS)
        squares = [
            float((self.turn_angle(t, i) ** 2).sum(axis=1).mean()) for i in (0, 1)
        ]
        return squares[0], squares[1]

    @property
    def mean_hz(self) -> float:
        """Frequency of one wave with the same mean squares, Hz."""
        turned, rate = self.mean_squares
        return float(np.sqrt(rate / turned) / (2 * np.pi))

    @property
    def periods(self) -> float:
        """Number of periods in the stretch."""
        return self.mean_hz * (self.span[1] - self.span[0])

    def turn_angle(self, t: Array, order: int = 0) -> Array:
        """Rotation phi at instants t (n,), or its derivative, (n, 3) rad / s^order."""
        pulse = 2 * np.pi * self.hz[:, None]
        size = pulse ** (order - 1)
        wave = self._angle(t) + np.pi / 2 * (order - 1)
        out: Array = np.cos(wave) @ (size * self.cos[:, 3:])
        out += np.sin(wave) @ (size * self.sin[:, 3:])
        return out

    def outputs(self, t: Array) -> Array:
        """Outputs (n, 6) by swaying, at instants t (n,)."""
        return self.linear(t) + self.second_order(t)

    def linear(self, t: Array) -> Array:
        """Part of the outputs that is linear in the rotation, (n, 6)."""
        wave = self._angle(t)
        out: Array = np.cos(wave) @ self.cos + np.sin(wave) @ self.sin
        return out

    def second_order(self, t: Array) -> Array:
        """Part of second order: (1) and (2) of `sway` less the linear part, (n, 6)."""
        phi, rate = self.turn_angle(t), self.turn_angle(t, 1)
        out = np.empty((len(t), 6))
        out[:, :3] = np.cross(phi, np.cross(phi, self.force)) / 2
        out[:, :3] += np.cross(rate, np.cross(rate, self.arm))  # (1)
        out[:, 3:] = -np.cross(phi, rate) / 2  # (2)
        return out

    def _angle(self, t: Array) -> Array:
        out: Array = np.multiply.outer(t - self.middle, 2 * np.pi * self.hz)
        return out
