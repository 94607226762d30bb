"""The outputs are increments in the axes at the start of an interval.

    U += s w x f,    W += c w x w'

w' by the difference of rates half a STEP before and after. s in s, c in s^2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, Number, SimulatedEffect

STEP = 1e-3
"""Of the difference, s."""


class SimulatedIncrements(SimulatedEffect):
    """Sculling and coning terms of increments."""

    NUMBERS = {"sculling": Number(0.0), "coning": Number(0.0)}
    EXAMPLE = Example({"sculling": 0.005, "coning": 4e-4}, in_motion=True)

    def filtered_outputs(self, outputs: Callable[[Array], Array], t: Array) -> Array:
        """Outputs (6, n) at t (n,) s with rate across force and across its change."""
        now = outputs(t)
        force, rate = now[:3], now[3:]
        change = (outputs(t + STEP / 2) - outputs(t - STEP / 2))[3:] / STEP
        sculling = self["sculling"] * np.cross(rate, force, axis=0)
        coning = self["coning"] * np.cross(rate, change, axis=0)
        return np.concatenate([force + sculling, rate + coning])
