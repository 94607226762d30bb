"""The gyroscopes feel the force.

    W_i += sum_j g_ij f_j

f specific force, m/s^2; g in rad/s/(m/s^2).
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, matrix_names, of_gyr
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedGSensitivity(SimulatedEffect):
    """Gyroscope output by the force."""

    VECTOR = matrix_names("g")
    EXAMPLE = Example({"g12": 5e-5, "g23": -6e-5, "g31": 7e-5})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Gyroscope output by the force."""
        more: Array = of_gyr(self.matrix("g", conditions.f))
        return more
