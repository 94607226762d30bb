"""K3: accelerometer output that is cubic in force.

    U_i += k_i f_i^3

U and f m/s^2, device axes; k_i 1/(m/s^2)^2. At 0 and +-1 g it cannot be told from the
scale factor. Source: IEEE Std 1293, model equation, K3.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([np.pi / 2]), np.zeros(1), 10.0)  # f = (-10, 0, 0)
>>> np.round(Cubic().design(x)[0, 0], 6) + 0.0
array([-1000.,     0.,     0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class Cubic(Sensor):
    """Third-order nonlinearity of the accelerometers."""

    params = tuple(Param(i, "1/(m/s^2)^2", 1e-5) for i in "xyz")
    covariate = "f^3"
    decided_by = "positions with the axis at 45° besides 0 and ±1 g"
    cure = "Use the calibration that diagnose gives with it, or keep to small forces."
    source = "IEEE Std 1293, K3; 1e-6 to 1e-5 on MEMS parts"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Cube of the force along the output's own axis."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            f = x.f[:, i]
            out[:, i, i] = f * f * f  # numpy's power takes thirty times as long
        return out
