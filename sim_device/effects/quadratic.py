"""The accelerometers are bent by the square of the force.

    U_i += k_i f_i^2

f specific force, m/s^2; k in 1/(m/s^2).
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedQuadratic(SimulatedEffect):
    """Accelerometer output by the square of the force."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 1e-4, "y": -8e-5, "z": 1.2e-4})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Accelerometer output by the square of the force."""
        more: Array = of_acc(self.column(AXES) * conditions.f**2)
        return more
