"""A line in the outputs: mains, an engine, a fan.

U_i += a_i sin(2 pi hz t + phase),    W_i += a_i sin(2 pi hz t + phase)
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import ABOVE_ZERO, SIX, Example, Number, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedHum(SimulatedEffect):
    """Oscillation at one frequency in each output."""

    VECTOR = SIX
    NUMBERS = {"hz": Number(range=ABOVE_ZERO), "phase_deg": Number(0.0)}
    REPEATS = True
    EXAMPLE = Example({"ax": 0.01, "ay": 0.008, "hz": 7.0})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Oscillation at one frequency in each output."""
        phase = 2 * np.pi * self["hz"] * conditions.t + np.deg2rad(self["phase_deg"])
        wave: Array = np.sin(phase)
        return self.column(SIX) * wave
