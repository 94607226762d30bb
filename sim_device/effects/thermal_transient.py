"""The biases approach other values from an instant on, as in the sun.

    U_i += a_i [1 - exp(-(t - t_0) / tau)],    W_i the same,    t >= t_0 = at_s

t since the start, s.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import ABOVE_ZERO, SIX, Example, Number, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedThermalTransient(SimulatedEffect):
    """Exponential approach of the biases to other values."""

    VECTOR = SIX
    NUMBERS = {"at_s": Number(), "tau_s": Number(range=ABOVE_ZERO)}
    REPEATS = True
    EXAMPLE = Example(
        {"ax": 0.03, "ay": -0.02, "gx": 4e-4, "at_s": 60.0, "tau_s": 90.0}
    )

    def added_output(self, conditions: SensorConditions) -> Array:
        """Bias change since the instant."""
        heated = np.clip(conditions.t - self["at_s"], 0.0, None) / self["tau_s"]
        more: Array = self.column(SIX) * (1.0 - np.exp(-heated))
        return more
