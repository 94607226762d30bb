"""Each accelerometer feels the axes across.

    U_i += sum_(j != i) k_ij f_j

f specific force, m/s^2.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, matrix_names, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedCrossCoupling(SimulatedEffect):
    """Cross-coupling of the accelerometers."""

    VECTOR = matrix_names("k", diagonal=False)
    EXAMPLE = Example({"k13": 3e-3, "k21": -2e-3, "k32": 4e-3})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Cross-coupling of the accelerometers."""
        more: Array = of_acc(self.matrix("k", conditions.f))
        return more
