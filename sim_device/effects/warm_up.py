"""The biases settle after the device is switched on.

    U_i += a_i exp(-t / tau),    W_i += a_i exp(-t / tau)

t since the device was switched on, s.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import ABOVE_ZERO, SIX, Example, Number, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedWarmUp(SimulatedEffect):
    """Remaining bias change since the device was switched on."""

    VECTOR = SIX
    NUMBERS = {"tau_s": Number(range=ABOVE_ZERO)}
    REPEATS = True
    EXAMPLE = Example({"ax": 0.03, "ay": -0.02, "gx": 4e-4, "tau_s": 90.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Remaining bias change since the device was switched on."""
        more: Array = self.column(SIX) * np.exp(-conditions.t / self["tau_s"])
        return more
