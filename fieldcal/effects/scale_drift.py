"""Accelerometer scale factors that drift steadily.

    U_i += r_i t f_i

U and f m/s^2, device axes; t, s, since the session's start; r 1/s. The output of a
sensor that is ratiometric is proportional to its supply, so a battery that falls under
load, or a voltage reference that warms up, changes the scale factors of all axes alike.
Source: IEEE Std 1293, stability of the scale factor; Analog Devices, ADXL335, Rev. B,
page 12: the output is ratiometric.

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 10.0, since_start=np.array([3.0]))
>>> ScaleDrift().design(x)[0, 1] + 0.0  # f = (0, -10, 0)
array([  0., -30.,   0.])
"""

from __future__ import annotations

from collections.abc import Mapping

from fieldcal.core.samples import Array
from fieldcal.physics.effect import BEYOND, NO_SHAPE, Param, ScaleChange
from fieldcal.physics.experience import Experience


class ScaleDrift(ScaleChange):
    """Linear change of the accelerometers' scale factors."""

    params = tuple(Param(i, "1/s", 1e-5) for i in "xyz")
    covariate = "time × force"
    seen_in = "time"
    absent = "at the start"
    decided_by = "the first position once more at the end"
    cure = (
        "Supply the device from a regulated voltage, let it warm up, and take the "
        "first position again at the end."
    )
    source = "judged: a ratiometric output, supply 0.1 to 1 % lower in minutes"

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one; less where a thermometer shows a change."""
        return BEYOND if x.warms else 3e-3

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Time."""
        return x.since_start
