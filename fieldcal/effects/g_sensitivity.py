"""Gyroscopes that feel force: a bias that turns with the position.

    W_i += sum over j of g_ij f_j

W output, rad/s, and f specific force, m/s^2, device axes; g_ij (rad/s)/(m/s^2) is the
response of the gyroscope i to force along j. Source: IEEE Std 1431, g-sensitivity;
data sheets state 0.005 to 0.2 deg/s per g.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)  # f = (0, -10, 0)
>>> GSensitivity().design(x)[0, 3] + 0.0  # the x gyroscope sees -10 g12
array([  0., -10.,   0.,   0.,   0.,   0.,   0.,   0.,   0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class GSensitivity(Sensor):
    """Linear g-sensitivity of the gyroscopes."""

    params = tuple(
        Param(f"g{i}{j}", "(rad/s)/(m/s^2)", 2e-4) for i in (1, 2, 3) for j in (1, 2, 3)
    )
    covariate = "force"
    decided_by = "positions that load each axis alone, up and down"
    cure = "Take the coefficients times the measured force out of the rates."
    source = "IEEE Std 1431, g-sensitivity; 5e-7 to 2e-4 on MEMS parts"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Row i of the matrix multiplies the force."""
        out = np.zeros((len(x), 6, 9))
        for i in range(3):
            out[:, 3 + i, 3 * i : 3 * i + 3] = x.f
        return out
