"""Vibration shifts the accelerometers by its square.

    U_i += v_i u_i^2

u vibration about the force, m/s^2; in each position its rms is another share of
`level`. v in 1/(m/s^2).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    AXES,
    NOT_NEGATIVE,
    Example,
    Number,
    SimulatedEffect,
    of_acc,
)
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedVibrationRectification(SimulatedEffect):
    """Accelerometer output by rectified vibration."""

    VECTOR = AXES
    NUMBERS = {"level": Number(0.3, NOT_NEGATIVE)}
    EXAMPLE = Example({"x": 0.08, "y": -0.09, "z": 0.08}, window_s=25.0, vibration=1.5)

    def added_output(self, conditions: SensorConditions) -> Array:
        """Accelerometer output by rectified vibration."""
        more: Array = of_acc(self.column(AXES) * conditions.vibration**2)
        return more

    def vibration_rms(self, rng: np.random.Generator) -> float:
        """A share of the level, another in each position."""
        return self["level"] * float(rng.random())
