"""The accelerometers' scale factors change at an instant.

U_i += q_i f_i    from the instant at on
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, Number, SimulatedEffect, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedScaleStep(SimulatedEffect):
    """Step of the scale factors."""

    VECTOR = AXES
    NUMBERS = {"at_s": Number()}
    REPEATS = True
    EXAMPLE = Example({"x": 2e-3, "y": -3e-3, "z": 2e-3, "at_s": 101.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Step of the scale factors."""
        begun = np.where(conditions.t >= self["at_s"], 1.0, 0.0)
        more: Array = of_acc(self.column(AXES) * begun * conditions.f)
        return more
