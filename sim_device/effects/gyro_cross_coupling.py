"""Each gyroscope feels the axes across.

    W_i += sum_(j != i) s_ij w_j

w angular rate, rad/s.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, matrix_names, of_gyr
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedGyroCrossCoupling(SimulatedEffect):
    """Cross-coupling of the gyroscopes."""

    VECTOR = matrix_names("s", diagonal=False)
    EXAMPLE = Example({"s13": 1e-2, "s31": -1.2e-2, "s23": 1.5e-2})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Cross-coupling of the gyroscopes."""
        more: Array = of_gyr(self.matrix("s", conditions.w))
        return more
