"""A pendulum that swings out feels products of the forces.

    U_i += l_i1 fx fy + l_i2 fy fz + l_i3 fx fz

f specific force, m/s^2; l in 1/(m/s^2).
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    Example,
    SimulatedEffect,
    matrix_names,
    of_acc,
    pairs,
)
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedPendulousProducts(SimulatedEffect):
    """Accelerometer output by products of the forces."""

    VECTOR = matrix_names("l")
    EXAMPLE = Example({"l11": 2e-4, "l22": -2e-4, "l33": 2e-4})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Accelerometer output by products of the forces."""
        more: Array = of_acc(self.matrix("l", pairs(conditions.f)))
        return more
