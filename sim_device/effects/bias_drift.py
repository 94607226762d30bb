"""The biases drift steadily.

    U_i += d_i t,    W_i += d_i t

t since the device was switched on, s.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import SIX, Example, SimulatedEffect
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedBiasDrift(SimulatedEffect):
    """Drift of the biases since the device was switched on."""

    VECTOR = SIX
    EXAMPLE = Example({"ax": 5e-5, "gy": 2e-6, "az": -4e-5})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Drift of the biases since the device was switched on."""
        more: Array = self.column(SIX) * conditions.t
        return more
