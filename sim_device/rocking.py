"""The base moves: it sways on and on, or it is bumped once.

Sway is a rocking about a level axis by a sine,

    x(t) = A sin(2 pi h t + p)                                      (r1)

and a bump lasts T, gives the base a push with no net velocity and rocks it there and
back, with u = (t - start) / T in 0..1:

    x(u) = A (4 u (1 - u))^3                                        (r2)
    a(u) = S (4 u (1 - u))^3 (1 - 2 u) / P                          (r3)

where P = 0.2380 is the peak of the shape, so that S is the peak acceleration.
Angles in rad, S in m/s^2, level axes (East, down, north).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.motion import Angle, Rocking

_PEAK = 6**3 / 7**3 / np.sqrt(7)
"""Peak of (1 - c^2)^3 c over c in 0..1, at c = 1/sqrt(7)."""


def level_axis(azimuth: float) -> Array:
    """Unit vector (3, 1) in the level, `azimuth` rad from East towards north."""
    return np.array([[np.cos(azimuth)], [0.0], [np.sin(azimuth)]])


@dataclass(frozen=True, slots=True)
class SwayMotion:
    """Amplitude rad, frequency Hz, phase rad, azimuth of the axis rad."""

    amplitude: float
    hz: float
    phase: float = 0.0
    azimuth: float = np.pi / 4

    def rocking(self) -> Rocking:
        """The motion of the base."""
        return Rocking(level_axis(self.azimuth), self._angle)

    def _angle(self, t: Array) -> Angle:
        pulse = 2 * np.pi * self.hz
        phase = pulse * t + self.phase
        x = self.amplitude * np.sin(phase)  # (r1)
        return Angle(x, self.amplitude * pulse * np.cos(phase), -(pulse**2) * x)


@dataclass(frozen=True, slots=True)
class Push:
    """A push that begins at `start` and lasts `seconds`.

    Attributes
    ----------
    start, seconds : s
    push : peak acceleration, m/s^2
    tilt : peak of the rocking, rad
    azimuth : of the axis that it rocks about, rad; the push is across it

    """

    start: float
    seconds: float
    push: float
    tilt: float
    azimuth: float

    def rocking(self) -> Rocking:
        """The rotation of the base."""
        return Rocking(level_axis(self.azimuth), self._angle)

    def acceleration(self, t: Array) -> Array:
        """Acceleration (3, n) of the base, level axes."""
        u = self._phase(t)
        c = 1 - 2 * u
        shape = (1 - c * c) ** 3 * c / _PEAK  # (r3)
        across: Array = level_axis(self.azimuth + np.pi / 2)
        push: Array = across * (self.push * shape)
        return push

    def over(self, t: float) -> bool:
        """Whether nothing of it is left at `t`."""
        return t > self.start + self.seconds

    def _phase(self, t: Array) -> Array:
        u: Array = np.clip((t - self.start) / self.seconds, 0.0, 1.0)
        return u

    def _angle(self, t: Array) -> Angle:
        u = self._phase(t)
        c, k = 1 - 2 * u, -2 / self.seconds
        s = 1 - c * c
        return Angle(  # (r2), with dc/dt = k
            self.tilt * s**3,
            self.tilt * -6 * c * s**2 * k,
            self.tilt * (24 * c * c * s - 6 * s**2) * k * k,
        )
