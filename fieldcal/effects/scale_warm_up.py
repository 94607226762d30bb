"""Accelerometer scale factors that settle after power-on.

    U_i += q_i f_i exp(-t / tau)                                                   (1)

U and f m/s^2, device axes; t, s, since the session's start; q 1. It comes with
`warm_up`: scale factors change with the temperature as biases do. Source: first-order
warm-up of a package; InvenSense, MPU-6050, 0.02 %/K.

>>> import numpy as np
>>> still = np.zeros(1)
>>> x = Experience.at_rest(still, still, 10.0, since_start=np.array([300.0]))
>>> np.round(ScaleWarmUp().design(x, {"tau_s": 300.0})[:, 1, 1], 3)  # f = (0, -10, 0)
array([-3.679])
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from fieldcal.core.samples import Array
from fieldcal.effects.warm_up import WarmUp
from fieldcal.physics.effect import BEYOND, NO_SHAPE, Param, ScaleChange
from fieldcal.physics.experience import Experience


class ScaleWarmUp(ScaleChange):
    """Exponential change of the accelerometers' scale factors since power-on."""

    params = tuple(Param(i, "1", 3e-3) for i in "xyz")
    shapes = tuple(replace(s, points=3) for s in WarmUp.shapes)
    event = "warm_up"
    covariate = "time × force"
    seen_in = "time"
    absent = WarmUp.absent
    decided_by = WarmUp.decided_by
    cure = WarmUp.cure
    source = "first-order warm-up of a package, 0.02 %/K, 5 to 30 K"

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one; less where a thermometer shows a change."""
        return BEYOND if x.warms else 3e-3

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The exponential, (1)."""
        return WarmUp().course(x, shape)
