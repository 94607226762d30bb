"""The biases follow the rate of the temperature.

    U_i += h_i dT/dt,    W_i += h_i dT/dt

T temperature, K.
"""

from __future__ import annotations

import math

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import SIX, Example, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions

CYCLING = [[float(t), 20 + 6 * math.sin(t / 35.0)] for t in range(0, 400, 5)]
"""An air that warms and cools, (s, °C)."""


class SimulatedThermalHysteresis(SimulatedEffect):
    """Bias change by the rate of the temperature."""

    VECTOR = SIX
    EXAMPLE = Example(
        {"ax": 0.15, "ay": -0.1}, device={"temperature": {"points": CYCLING}}
    )

    def added_output(self, conditions: SensorConditions) -> Array:
        """Bias change by the rate of the temperature."""
        more: Array = self.column(SIX) * conditions.temperature_rate
        return more
