"""The sensors follow with a time constant: a low-pass of first order.

    h(s) = exp(-s)

is the response to an impulse, s in time constants.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example
from fieldcal.sim_device.impulse_response import SimulatedLowPass


class SimulatedBandwidth(SimulatedLowPass):
    """Time constants of both triads, s."""

    PAST, STEPS = 16.0, 64
    EXAMPLE = Example({"acc": 0.02, "gyr": 0.03}, in_motion=True)

    @staticmethod
    def response(age: Array) -> Array:
        """An exponential."""
        return np.exp(-age)
