"""The accelerometers' scale factors differ between up and down.

    U_i += k_i |f_i|

f specific force, m/s^2.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import AXES, Example, SimulatedEffect, of_acc
from fieldcal.sim_device.life import Life


class SimulatedScaleAsymmetry(SimulatedEffect):
    """What the size of the force adds."""

    VECTOR = AXES
    EXAMPLE = Example({"x": 3e-3, "y": -2e-3, "z": 2e-3})

    def adds(self, life: Life) -> Array:
        """What the size of the force adds."""
        more: Array = of_acc(self.column(AXES) * np.abs(life.f))
        return more
