"""The accelerometers' scale factors settle after the device is switched on.

    U_i += q_i f_i exp(-t / tau)

t since the device was switched on, s.
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


class SimulatedScaleWarmUp(SimulatedEffect):
    """Remaining change of the scale factors since the device was switched on."""

    VECTOR = AXES
    NUMBERS = {"tau_s": Number(range=ABOVE_ZERO)}
    REPEATS = True
    EXAMPLE = Example({"x": 4e-3, "y": -6e-3, "z": 4e-3, "tau_s": 90.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Remaining change of the scale factors."""
        left = np.exp(-conditions.t / self["tau_s"])
        more: Array = of_acc(self.column(AXES) * left * conditions.f)
        return more
