"""The biases change at an instant.

U_i += s_i,    W_i += s_i    from the instant at on
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import SIX, Example, Number, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedBiasStep(SimulatedEffect):
    """Step of the biases."""

    VECTOR = SIX
    NUMBERS = {"at_s": Number()}
    REPEATS = True
    EXAMPLE = Example({"ax": 0.01, "az": -0.008, "at_s": 101.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Step of the biases."""
        more: Array = self.column(SIX) * np.where(
            conditions.t >= self["at_s"], 1.0, 0.0
        )
        return more
