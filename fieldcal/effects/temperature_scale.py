"""Accelerometer scale factors that follow the temperature.

    U_i += kappa_i dT f_i

U and f m/s^2, device axes; dT, K, the temperature less that at the session's start;
kappa 1/K. Source: IEEE Std 1293, scale factor temperature sensitivity.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 10.0, warming=np.array([3.0]))
>>> TemperatureScale().design(x)[0, 1] + 0.0  # f = (0, -10, 0)
array([  0., -30.,   0.])
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, ScaleChange
from fieldcal.physics.experience import Experience


class TemperatureScale(ScaleChange):
    """Temperature coefficient of the accelerometers' scale factors."""

    params = tuple(Param(i, "1/K", 3e-4) for i in "xyz")
    covariate = "temperature × force"
    seen_in = "temperature"
    absent = "at the start's temperature"
    decided_by = "the axis up and down, cold and warm"
    cure = "Calibrate at the temperature of use, or apply the coefficients."
    source = "IEEE Std 1293; 1e-5 to 3e-4 on MEMS parts"

    def applies(self, x: Experience) -> bool:
        """Where a thermometer shows a change."""
        return x.warms

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Temperature less that at the start."""
        return x.warming
