"""Whoever sets an angle does so a little off, every time by another amount.

angle <- angle + sigma z,    z standard normal
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import NOT_NEGATIVE, Example, Number, SimulatedEffect


class SimulatedAngleSetting(SimulatedEffect):
    """Random error of the angles that are set by hand."""

    NUMBERS = {"sigma_deg": Number(range=NOT_NEGATIVE)}
    ORDER = 2
    EXAMPLE = Example({"sigma_deg": 0.15})

    def joint_setting(self, rng: np.random.Generator) -> Callable[[Array], Array]:
        """Random error of the angles that are set by hand."""
        sigma = np.deg2rad(self["sigma_deg"])
        return lambda angles: angles + sigma * rng.standard_normal(2)
