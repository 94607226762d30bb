"""Vibration shifts the mean of an accelerometer.

    U_i += v_i var_i

U m/s^2; var_i, (m/s^2)^2, the variance of the vibration along i; v_i 1/(m/s^2).
Source: IEEE Std 1293, vibration rectification; 1e-4 to 1e-2 on MEMS parts.

>>> import numpy as np
>>> variance = np.array([[4.0, 0.0, 1.0]])
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, variance=variance)
>>> VibrationRectification().design(x)[0, :3]
array([[4., 0., 0.],
       [0., 0., 0.],
       [0., 0., 1.]])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class VibrationRectification(Sensor):
    """Rectification of vibration by the accelerometers."""

    params = tuple(Param(i, "1/(m/s^2)", 1e-2) for i in "xyz")
    covariate = "variance of the vibration"
    decided_by = "the same position with the source of vibration off and on"
    cure = "Switch the source of the vibration off, or put the device on a damper."
    source = "IEEE Std 1293; 1e-4 to 1e-2 on MEMS parts"

    def applies(self, x: Experience) -> bool:
        """Where some windows are shaken and others not."""
        return bool((np.ptp(x.variance, axis=0) > 0).any())

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Variance of the vibration along the output's own axis."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            out[:, i, i] = x.variance[:, i]
        return out
