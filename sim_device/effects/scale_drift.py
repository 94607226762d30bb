"""The accelerometers' scale factors drift steadily.

    U_i += r_i t f_i

t since the device was switched on, s; f specific force, m/s^2.
"""

from __future__ import annotations

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_acc
from fieldcal.sim_device.sensor_conditions import SensorConditions


class SimulatedScaleDrift(SimulatedEffect):
    """Drift of the scale factors since the device was switched on."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 2e-5, "y": 2e-5, "z": 2e-5})

    def added_output(self, conditions: SensorConditions) -> Array:
        """Drift of the scale factors since the device was switched on."""
        more: Array = of_acc(self.column(AXES) * conditions.t * conditions.f)
        return more
