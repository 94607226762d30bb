"""The outputs are increments over an interval T, in the axes at one of its ends.

    U(t) = 1/T int R f dt',    W(t) = rotation vector over the interval / T

from t - T / 2 to t + T / 2, where R turns from the axes at t' into those at t - s, s.
T follows from the coning, T^2 / 12, s^2. Where both are negative, what is simulated
undoes the increments of the other simulator: R is the inverse, and what the mean
changes has the other sign.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array
from fieldcal.sim_device.effect import Example, Number, SimulatedEffect

NODE, WEIGHT = np.polynomial.legendre.leggauss(4)
"""Of a mean over -1 to 1; the weights have the sum 2."""


class SimulatedIncrements(SimulatedEffect):
    """Increments of velocity and of rotation."""

    NUMBERS = {"sculling": Number(0.0), "coning": Number(0.0)}
    EXAMPLE = Example({"sculling": 0.02, "coning": 4e-4 / 3}, in_motion=True)

    def filtered_outputs(self, outputs: Callable[[Array], Array], t: Array) -> Array:
        """Outputs (6, n) at t (n,) s as increments."""
        sign = -1.0 if self["coning"] < 0 else 1.0
        shift, length = sign * self["sculling"], np.sqrt(12 * abs(self["coning"]))
        turned = _increments(outputs, t, 0.0, shift, sign)
        if not length:
            return turned
        mean = _increments(outputs, t, length, shift)
        return turned + sign * (mean - _increments(outputs, t, 0.0, shift))


def _increments(
    outputs: Callable[[Array], Array],
    t: Array,
    length: float,
    shift: float,
    sign: float = 1.0,
) -> Array:
    """Increments over a length, s, divided by it, (6, n), in the axes at t - shift.

    With a `sign` of -1 they are turned the other way.
    """
    out = np.zeros((6, len(t)))
    for node, weight in zip(NODE, WEIGHT / 2, strict=True):
        later = node * length / 2
        now = outputs(t + later)
        turned = (shift + later) * outputs(t + (later - shift) / 2)[3:]
        axes = Rotation.from_rotvec(sign * turned.T)
        begun = later + length / 2
        angle = begun * outputs(t + (later - length / 2) / 2)[3:]
        out[:3] += weight * axes.apply(now[:3].T).T
        out[3:] += weight * (now[3:] + np.cross(angle, now[3:], axis=0) / 2)
    return out
