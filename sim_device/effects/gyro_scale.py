"""The scale factors of the gyroscopes are off.

    W_i += s_i w_i

w angular rate, rad/s.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, of_gyr
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedGyroScale(SimulatedEffect):
    """Scale factor error of the gyroscopes."""

    VECTOR = ("s1", "s2", "s3")
    EXAMPLE = Example({"s1": 2e-2, "s2": -1e-2, "s3": 1.5e-2})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Scale factor error of the gyroscopes."""
        more: Array = of_gyr(self.column(self.VECTOR) * conditions.w)
        return more
