"""The accelerometers' scale factors follow the temperature.

    U_i += k_i (T - T0) f_i

T temperature, T0 that at the start, K; f specific force, m/s^2.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedTemperatureScale(SimulatedEffect):
    """Scale factor change by the change of temperature."""

    VECTOR = AXES
    EXAMPLE = Example(
        {"x": 4e-4, "y": -3e-4, "z": 3e-4}, device={"temperature": {"ramp_k_s": 0.03}}
    )

    def added_output(self, conditions: SensorConditions) -> Array:
        """Scale factor change by the change of temperature."""
        more: Array = of_acc(
            self.column(AXES) * conditions.temperature_rise * conditions.f
        )
        return more
