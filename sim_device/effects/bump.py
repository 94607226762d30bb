"""The base is bumped once: a push with no net velocity, rocking it there and back.

It lasts T; with u = (t - start) / T in 0..1,

    x(u) = A (4 u (1 - u))^3                                        (1)
    a(u) = S (4 u (1 - u))^3 (1 - 2 u) / P                          (2)

where P = 0.2380 is the peak of the shape, so that S is the peak acceleration, m/s^2.
x is an angle about a level axis, rad, `azimuth` from East towards north; the push is
across it.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import ABOVE_ZERO, Example, Number, SimulatedEffect
from fieldcal.sim_device.motion import Angle, BaseMotion, level_axis

PEAK = 6**3 / 7**3 / np.sqrt(7)
"""Peak of (1 - c^2)^3 c over c in 0..1, at c = 1/sqrt(7)."""


class SimulatedBump(SimulatedEffect):
    """Single disturbance of the base."""

    NUMBERS = {
        "at_s": Number(),
        "for_s": Number(range=ABOVE_ZERO),
        "push": Number(2.0),
        "tilt_deg": Number(0.5),
        "azimuth_deg": Number(30.0),
    }
    REPEATS = True
    ORDER = 1
    EXAMPLE = Example({"at_s": 55.0, "for_s": 0.7})

    def base_motion(self) -> BaseMotion:
        """The rocking and the push, from the start to the end."""
        start, axis = self["at_s"], level_axis(np.deg2rad(self["azimuth_deg"]))
        end = start + self["for_s"]
        return BaseMotion(axis, self._angle, self._push, start, end)

    def _phase(self, t: Array) -> Array:
        u: Array = np.clip((t - self["at_s"]) / self["for_s"], 0.0, 1.0)
        return u

    def _push(self, t: Array) -> Array:
        """Acceleration of the base, (3, n), level axes."""
        c = 1 - 2 * self._phase(t)
        shape = (1 - c * c) ** 3 * c / PEAK  # (2)
        across: Array = level_axis(np.deg2rad(self["azimuth_deg"]) + np.pi / 2)
        push: Array = across * (self["push"] * shape)
        return push

    def _angle(self, t: Array) -> Angle:
        tilt = np.deg2rad(self["tilt_deg"])
        c, k = 1 - 2 * self._phase(t), -2 / self["for_s"]
        s = 1 - c * c
        return Angle(  # (1), with dc/dt = k
            tilt * s**3,
            tilt * -6 * c * s**2 * k,
            tilt * (24 * c * c * s - 6 * s**2) * k * k,
        )
