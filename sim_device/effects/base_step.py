"""The base is knocked: in a fifth of a second it goes over to another tilt.

With u = (t - at) / T in 0..1, it turns about one level axis by

    x(u) = A (6 u^5 - 15 u^4 + 10 u^3)                              (1)

A along (about_x_deg, 0, about_z_deg) from the axes of the base.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, Number, SimulatedEffect
from fieldcal.sim_device.motion import Angle, BaseMotion

LASTS_S = 0.2
"""How long the base moves."""


class SimulatedBaseStep(SimulatedEffect):
    """Tilt of the base after the step."""

    VECTOR = ("about_x_deg", "about_z_deg")
    NUMBERS = {"at_s": Number()}
    REPEATS = True
    EXAMPLE = Example({"about_x_deg": 0.2, "about_z_deg": -0.15, "at_s": 101.0})

    def base_motion(self) -> BaseMotion | None:
        """The base going over; it stays there."""
        about_x, about_z = np.deg2rad(self.column(self.VECTOR))[:, 0]
        size = float(np.hypot(about_x, about_z))
        if not size:
            return None
        axis = np.array([[about_x], [0.0], [about_z]]) / size
        start = self["at_s"]
        return BaseMotion(axis, lambda t: _over(t, start, size), start=start)


def _over(t: Array, start: float, size: float) -> Angle:
    """The angle (1) with its derivatives."""
    u = np.clip((t - start) / LASTS_S, 0.0, 1.0)
    rate = 30 * u**2 * (1 - u) ** 2 / LASTS_S
    bends = 60 * u * (1 - u) * (1 - 2 * u) / LASTS_S**2
    x = u**3 * (6 * u**2 - 15 * u + 10)
    return Angle(size * x, size * rate, size * bends)
