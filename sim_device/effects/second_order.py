"""The sensors follow as a Butterworth low-pass of second order does.

    h(s) = sqrt(2) exp(-s / sqrt(2)) sin(s / sqrt(2))

is the response to an impulse, s in time constants.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example
from fieldcal.sim_device.impulse_response import SimulatedLowPass


class SimulatedSecondOrder(SimulatedLowPass):
    """Time constants of both triads, s."""

    PAST, STEPS = 24.0, 120
    EXAMPLE = Example({"acc": 0.03, "gyr": 0.04}, in_motion=True)

    @staticmethod
    def response(age: Array) -> Array:
        """A wave that dies within its first half."""
        slow = age / np.sqrt(2)
        ring: Array = np.exp(-slow) * np.sin(slow)
        return ring
