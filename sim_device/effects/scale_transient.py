"""The accelerometers' scale factors approach other values from an instant on.

    U_i += q_i f_i [1 - exp(-(t - t_0) / tau)],    t >= t_0 = at_s

t since the start, s.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    ABOVE_ZERO,
    AXES,
    Example,
    Number,
    SimulatedEffect,
    of_acc,
)
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedScaleTransient(SimulatedEffect):
    """Exponential approach of the scale factors to other values."""

    VECTOR = AXES
    NUMBERS = {"at_s": Number(), "tau_s": Number(range=ABOVE_ZERO)}
    REPEATS = True
    EXAMPLE = Example({"x": 2e-3, "y": -3e-3, "z": 2e-3, "at_s": 60.0, "tau_s": 60.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Change of the scale factors since the instant."""
        heated = np.clip(conditions.t - self["at_s"], 0.0, None) / self["tau_s"]
        begun = 1.0 - np.exp(-heated)
        more: Array = of_acc(self.column(AXES) * begun * conditions.f)
        return more
