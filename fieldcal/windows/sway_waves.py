"""Waves of the outputs in a window on a swaying base, and the rotation they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

POINTS = 400
"""Instants at which the turning of a stretch is looked at."""

PERIODS = 1.2
"""Waves below which a stretch does not tell their frequency from what drifts: means
are then up to twenty times as far off as the fit has it."""


@dataclass(frozen=True, slots=True)
class Waves:
    """What sways in a stretch of a window.

    Attributes
    ----------
    hz : (k,) frequencies
    middle : s, where their phases count from
    cos, sin : (k, 6) amplitudes of the outputs
    force, arm : (3,) m/s^2 and m, force at rest and arm from the turning centre
    left : (6,) variance of the means at rest beyond that of white noise
    noise : (6,) variance of a mean over a cell of `length` s; nan without gyroscopes
    length : s
    span : s, the stretch that was looked at
    scale : (3,) outputs of the gyroscopes in a rad/s

    """

    hz: Array
    middle: float
    cos: Array
    sin: Array
    force: Array
    arm: Array
    left: Array
    noise: Array
    length: float
    span: tuple[float, float]
    scale: Array

    @property
    def size(self) -> tuple[float, float]:
        """Mean squares of the turning, rad^2, and of its rate, rad^2/s^2."""
        t = np.linspace(*self.span, POINTS)
        squares = [float((self.turn(t, i) ** 2).sum(axis=1).mean()) for i in (0, 1)]
        return squares[0], squares[1]

    @property
    def mean_hz(self) -> float:
        """Frequency of one wave with all their power, Hz."""
        turned, rate = self.size
        return float(np.sqrt(rate / turned) / (2 * np.pi))

    @property
    def periods(self) -> float:
        """Waves in the stretch."""
        return self.mean_hz * (self.span[1] - self.span[0])

    def turn(self, t: Array, order: int = 0) -> Array:
        """Phi at some instants, or its derivative of some order, (n, 3) rad."""
        pulse = 2 * np.pi * self.hz[:, None]
        size = pulse ** (order - 1) / self.scale
        wave = self._angle(t) + np.pi / 2 * (order - 1)
        out: Array = np.cos(wave) @ (size * self.cos[:, 3:])
        out += np.sin(wave) @ (size * self.sin[:, 3:])
        return out

    def of(self, t: Array) -> Array:
        """What swaying adds to the outputs at some instants, (n, 6)."""
        return self.linear(t) + self.squares(t)

    def linear(self, t: Array) -> Array:
        """What is linear in the turning, (n, 6)."""
        wave = self._angle(t)
        out: Array = np.cos(wave) @ self.cos + np.sin(wave) @ self.sin
        return out

    def squares(self, t: Array) -> Array:
        """Its squares: (1) and (2) of `sway` less what is linear, (n, 6)."""
        phi, rate = self.turn(t), self.turn(t, 1)
        out = np.empty((len(t), 6))
        out[:, :3] = np.cross(phi, np.cross(phi, self.force)) / 2
        out[:, :3] += np.cross(rate, np.cross(rate, self.arm))  # (1)
        out[:, 3:] = -np.cross(phi, rate) / 2 * self.scale  # (2)
        return out

    def _angle(self, t: Array) -> Array:
        out: Array = np.multiply.outer(t - self.middle, 2 * np.pi * self.hz)
        return out
