"""K2: accelerometer output that is even in force.

    U_i += k_i f_i^2

U and f m/s^2, device axes; k_i 1/(m/s^2). At 0 and +-1 g it cannot be told from
`scale_asymmetry`. Source: IEEE Std 1293, model equation, K2.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([np.pi / 2]), np.zeros(1), 10.0)  # f = (-10, 0, 0)
>>> np.round(Quadratic().design(x)[0, 0], 6) + 0.0
array([100.,   0.,   0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class Quadratic(Sensor):
    """Second-order nonlinearity of the accelerometers."""

    params = tuple(Param(i, "1/(m/s^2)", 5e-4) for i in "xyz")
    covariate = "f^2"
    decided_by = "positions with the axis at 45° besides 0 and ±1 g"
    cure = (
        "Use the calibration that diagnose gives with it, and take the "
        "coefficients out of the forces."
    )
    source = "IEEE Std 1293, K2; 1e-5 to 5e-4 on MEMS parts"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Square of the force along the output's own axis."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            out[:, i, i] = x.f[:, i] ** 2
        return out
