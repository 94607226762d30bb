"""Accelerometer scale factors that settle toward other values from an instant on.

    U_i += q_i f_i [1 - exp(-(t - t_0) / tau)],    t >= t_0                         (1)

U and f m/s^2, device axes; t_0 = at_s, device time, s; q 1. It comes with
`thermal_transient`: scale factors change with the temperature as biases do. Source:
first-order heating of a package; InvenSense, MPU-6050, 0.02 %/K.

>>> import numpy as np
>>> still = np.zeros(2)
>>> x = Experience.at_rest(still, still, 10.0, t=np.array([50.0, 400.0]))
>>> shape = {"at_s": 100.0, "tau_s": 300.0}
>>> np.round(ScaleTransient().design(x, shape)[:, 1, 1], 3) + 0.0  # f = (0, -10, 0)
array([ 0.   , -6.321])
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from fieldcal.core.samples import Array
from fieldcal.effects.thermal_transient import ThermalTransient
from fieldcal.physics.effect import BEYOND, NO_SHAPE, Param, ScaleChange
from fieldcal.physics.experience import Experience


class ScaleTransient(ScaleChange):
    """Exponential change of the accelerometers' scale factors from an instant on."""

    params = tuple(Param(i, "1", 3e-3) for i in "xyz")
    shapes = tuple(replace(s, points=1) for s in ThermalTransient.shapes)
    event = "thermal_transient"
    covariate = "time × force"
    seen_in = "time"
    absent = ThermalTransient.absent
    decided_by = ThermalTransient.decided_by
    cure = ThermalTransient.cure
    source = "first-order heating of a package, 0.02 %/K, 5 to 30 K"

    def chance(self, x: Experience) -> float:
        """Of a thousand sessions one alone; less where a thermometer shows a change."""
        return BEYOND if x.warms else 1e-3

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The approach to the new value, (1)."""
        return ThermalTransient().course(x, shape)
