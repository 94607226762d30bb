"""The biases settle after each turn.

    U_i += a_i exp(-(t - end of the turn) / tau),    W_i likewise

Building up while the device is turned.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import ABOVE_ZERO, SIX, Example, Number, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedSettling(SimulatedEffect):
    """Remaining bias change since the last turn."""

    VECTOR = SIX
    NUMBERS = {"tau_s": Number(range=ABOVE_ZERO)}
    REPEATS = True
    EXAMPLE = Example({"ax": 0.03, "ay": 0.02, "az": -0.03, "tau_s": 4.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Remaining bias change since the last turn."""
        after = np.exp(-np.maximum(conditions.since_turn, 0.0) / self["tau_s"])
        turned = np.where(conditions.turn_progress > 0, 1.0, 0.0)
        left: Array = turned * np.where(
            conditions.since_turn < 0, conditions.turn_progress, after
        )
        return self.column(SIX) * left
