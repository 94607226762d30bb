"""The gyroscopes feel products of the rates.

    W_i += p_i1 wx wy + p_i2 wy wz + p_i3 wx wz

w angular rate, rad/s; p in 1/(rad/s).
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    Example,
    SimulatedEffect,
    matrix_names,
    of_gyr,
    pairs,
)
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedGyroProducts(SimulatedEffect):
    """Gyroscope output by products of the rates."""

    VECTOR = matrix_names("p")
    EXAMPLE = Example({"p11": 5e-3, "p22": -6e-3, "p33": 4e-3}, turntable=True)

    def added_output(self, conditions: SensorConditions) -> Array:
        """Gyroscope output by products of the rates."""
        more: Array = of_gyr(self.matrix("p", pairs(conditions.w)))
        return more
