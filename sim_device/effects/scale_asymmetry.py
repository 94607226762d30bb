"""The accelerometers' scale factors differ between up and down.

    U_i += k_i |f_i|

f specific force, m/s^2.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedScaleAsymmetry(SimulatedEffect):
    """Accelerometer output by the magnitude of the force."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 3e-3, "y": -2e-3, "z": 2e-3})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Accelerometer output by the magnitude of the force."""
        more: Array = of_acc(self.column(AXES) * np.abs(conditions.f))
        return more
