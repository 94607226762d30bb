"""The gauges of the joints have a scale.

angle <- angle (1 + scale)
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect


class SimulatedAngleScale(SimulatedEffect):
    """Scale error of each joint's gauge."""

    VECTOR = ("alpha", "beta")
    ORDER = 0
    EXAMPLE = Example({"alpha": 8e-3, "beta": -6e-3})

    def joint_setting(self, rng: np.random.Generator) -> Callable[[Array], Array]:
        """Scale error of each joint's gauge."""
        scale = self.column(self.VECTOR)[:, 0]
        return lambda angles: angles * (1 + scale)
