"""Gyroscopes that feel the square of the force along their own axis.

    W_i += q_i f_i^2

W output, rad/s, and f specific force, m/s^2, device axes; q_i (rad/s)/(m/s^2)^2.
Source: IEEE Std 1431, acceleration-squared-sensitive drift.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)  # f = (0, -10, 0)
>>> G2Sensitivity().design(x)[0, 4]
array([  0., 100.,   0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class G2Sensitivity(Sensor):
    """Quadratic g-sensitivity of the gyroscopes."""

    params = tuple(Param(i, "(rad/s)/(m/s^2)^2", 5e-7) for i in "xyz")
    covariate = "f^2"
    decided_by = "positions with the axis at 0, 45 and 90°, up and down"
    cure = "Take the coefficients times the squared force out of the rates."
    source = "IEEE Std 1431; up to 5e-7 on MEMS parts"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Square of the force along the output's own axis."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            out[:, 3 + i, i] = x.f[:, i] ** 2
        return out
