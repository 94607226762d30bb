"""The accelerometers are bent by the cube of the force.

    U_i += k_i f_i^3

f specific force, m/s^2; k in 1/(m/s^2)^2.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedCubic(SimulatedEffect):
    """Output by the cube of the force."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 2e-5, "y": -3e-5, "z": 2e-5})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Output by the cube of the force."""
        more: Array = of_acc(
            self.column(AXES) * conditions.f * conditions.f * conditions.f
        )
        return more
