"""K+/K-: the scale factor differs between pushing and pulling.

    U_i += k_i |f_i|

U and f m/s^2, device axes; k_i dimensionless, half the difference of the two scale
factors. At 0 and +-1 g it cannot be told from `quadratic`. Source: IEEE Std 1293.

>>> import numpy as np
>>> x = Experience.at_rest(np.array([np.pi / 2]), np.zeros(1), 10.0)  # f = (-10, 0, 0)
>>> np.round(ScaleAsymmetry().design(x)[0, 0], 6) + 0.0
array([10.,  0.,  0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class ScaleAsymmetry(Sensor):
    """Asymmetry of the accelerometers' scale factor."""

    params = tuple(Param(i, "1", 5e-3) for i in "xyz")
    covariate = "sign of f"
    decided_by = "positions with the axis at 45° besides 0 and ±1 g"
    cure = (
        "Use the calibration that diagnose gives with it, and one scale factor "
        "for each sign."
    )
    source = "IEEE Std 1293, scale factor asymmetry; 1e-5 to 5e-3 on MEMS parts"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Size of the force along the output's own axis."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            out[:, i, i] = np.abs(x.f[:, i])
        return out
