"""The biases follow the temperature.

    U_i += c_i (T - T0),    W_i += c_i (T - T0)

T temperature, T0 that at the start, K.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import SIX, Example, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedTemperatureBias(SimulatedEffect):
    """Bias change by the change of temperature."""

    VECTOR = SIX
    EXAMPLE = Example(
        {"ax": 4e-3, "ay": -3e-3, "gz": 1e-4},
        device={"temperature": {"ramp_k_s": 0.03}},
    )

    def added_output(self, conditions: SensorConditions) -> Array:
        """Bias change by the change of temperature."""
        more: Array = self.column(SIX) * conditions.temperature_rise
        return more
