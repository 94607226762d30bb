"""The zeros of the joints are off.

angle <- angle + offset
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, SimulatedEffect


class SimulatedAngleOffset(SimulatedEffect):
    """Zero offset of each joint."""

    VECTOR = ("alpha0_deg", "beta0_deg")
    ORDER = 1
    EXAMPLE = Example({"alpha0_deg": 0.8, "beta0_deg": -0.9})

    def joint_setting(self, rng: np.random.Generator) -> Callable[[Array], Array]:
        """Zero offset of each joint."""
        offset = np.deg2rad(self.column(self.VECTOR)[:, 0])
        return lambda angles: angles + offset
