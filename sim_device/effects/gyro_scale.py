"""The scale factors of the gyroscopes are off.

    W_i += s_i w_i

w angular rate, rad/s.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect, of_gyr
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedGyroScale(SimulatedEffect):
    """What the gyroscopes show too much."""

    VECTOR = ("s1", "s2", "s3")
    EXAMPLE = Example({"s1": 2e-2, "s2": -1e-2, "s3": 1.5e-2})

    def added_output(self, conditions: SensorConditions) -> Array:
        """What the gyroscopes show too much."""
        more: Array = of_gyr(self.column(self.VECTOR) * conditions.w)
        return more
