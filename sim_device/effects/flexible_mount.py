"""The accelerometers sit on a structure that vibrates with its first mode.

    U'' / W^2 + 2 d U' / W + U = f + 2 d f' / W,    W = 1 / sqrt(b)

of each accelerometer's noiseless output, with the damping d of the structure, which
passes force as well. Solved by its response to an impulse,

    U(t) = int_0^inf f(t - s) h(s) ds,
    h(s) = W exp(-d W s) ((1 - 2 d^2) / r sin(r W s) + 2 d cos(r W s)),
    r = sqrt(1 - d^2)

by Simpson's rule until exp(-12) is left. b in s^2.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import (
    AXES,
    NOT_NEGATIVE,
    Example,
    Number,
    Range,
    SimulatedEffect,
)
from fieldcal.sim_device.impulse_response import Outputs, convolve, past_instants

LEFT, PER_RADIAN = 12.0, 6
"""Exponent at which the past ends, and steps in a radian of the mode."""

RINGS = Range("0.02 to 0.7", lambda v: 0.02 <= v <= 0.7)


class SimulatedFlexibleMount(SimulatedEffect):
    """Compliances of the axes, s^2, and the damping ratio of the structure."""

    NUMBERS = {axis: Number(0.0, NOT_NEGATIVE) for axis in AXES} | {
        "damping": Number(0.05, RINGS)
    }
    EXAMPLE = Example({"x": 3e-4, "y": 2e-4, "z": 4e-4, "damping": 0.2}, in_motion=True)

    def filtered_outputs(self, outputs: Outputs, t: Array) -> Array:
        """Outputs (6, n) at t (n,) s as the structure passes them on."""
        steps = 2 * int(PER_RADIAN * LEFT / self["damping"] / 2)
        now, by = (
            outputs(t),
            past_instants(self._response, LEFT / self["damping"], steps),
        )
        for i, axis in enumerate(AXES):
            if b := self[axis]:
                rows = slice(i, i + 1)
                now[rows] = convolve(outputs, t, rows, float(np.sqrt(b)), by)
        return now

    def _response(self, age: Array) -> Array:
        """The response to an impulse at ages in radians of the mode, over W."""
        d = self["damping"]
        r = np.sqrt(1 - d**2)
        sine = (1 - 2 * d**2) / r * np.sin(r * age)
        ring: Array = np.exp(-d * age) * (sine + 2 * d * np.cos(r * age))
        return ring
