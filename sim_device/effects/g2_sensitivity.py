"""The gyroscopes feel the square of the force.

    W_i += q_i f_i^2

f specific force, m/s^2; q in rad/s/(m/s^2)^2.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_gyr
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedG2Sensitivity(SimulatedEffect):
    """Gyroscope output by the square of the force."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 4e-6, "y": -5e-6, "z": 5e-6})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Gyroscope output by the square of the force."""
        more: Array = of_gyr(self.column(AXES) * conditions.f**2)
        return more
