"""The device slips in its mount: in a fifth of a second it is held otherwise.

With u = (t - at) / T in 0..1, it turns in its mount by

    x(u) = A (6 u^5 - 15 u^4 + 10 u^3)                              (1)

A = (about_x_deg, about_y_deg, about_z_deg) in axes of the device. What it feels is
turned the other way, and the gyroscopes feel the slip itself as well.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, Number, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions

LASTS_S = 0.2
"""How long the device moves."""


class SimulatedMountSlip(SimulatedEffect):
    """Attitude of the device in its mount after the slip."""

    VECTOR = ("about_x_deg", "about_y_deg", "about_z_deg")
    NUMBERS = {"at_s": Number()}
    REPEATS = True
    EXAMPLE = Example(
        {"about_x_deg": 0.2, "about_y_deg": 0.1, "about_z_deg": -0.15, "at_s": 101.0}
    )

    def added_output(self, conditions: SensorConditions) -> Array | None:
        """What it feels otherwise than before, by Rodrigues' formula."""
        slip = np.deg2rad(self.column(self.VECTOR))
        size = float(np.linalg.norm(slip))
        if not size:
            return None
        axis = slip / size
        u = np.clip((conditions.t - self["at_s"]) / LASTS_S, 0.0, 1.0)
        angle = size * u**3 * (6 * u**2 - 15 * u + 10)
        rate = size * 30 * u**2 * (1 - u) ** 2 / LASTS_S
        f, w = (_turned_back(v, axis, angle) for v in (conditions.f, conditions.w))
        return np.concatenate([f - conditions.f, w - conditions.w + rate * axis])


def _turned_back(v: Array, axis: Array, angle: Array) -> Array:
    """Components of vectors (3, n) for axes turned by angles (n,) about one, (3, 1)."""
    along = axis * (axis * v).sum(axis=0)
    aside = np.cross(axis, v, axis=0)
    out: Array = np.cos(angle) * (v - along) - np.sin(angle) * aside + along
    return out
