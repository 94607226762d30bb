"""Accelerometer scale factors that jump at an instant.

    U_i += q_i f_i (t >= t_0)

U and f m/s^2, device axes; t_0 = at_s, device time, s; q 1. Source: a device that
changes its range or begins to apply another calibration; Analog Devices, ADXL350, table
1: the sensitivity of each range has limits of its own, 7.5 % from its nominal value.

>>> import numpy as np
>>> still = np.zeros(2)
>>> x = Experience.at_rest(still, still, 10.0, t=np.array([9.0, 11.0]))
>>> ScaleStep().design(x, {"at_s": 10.0})[:, 1, 1] + 0.0  # f = (0, -10, 0)
array([  0., -10.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, ScaleChange
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape
from fieldcal.physics.step import step_course


class ScaleStep(ScaleChange):
    """Jump of the accelerometers' scale factors."""

    params = tuple(Param(i, "1", 3e-3) for i in "xyz")
    shapes = (Shape("at_s", "s", -np.inf, np.inf, "instant"),)
    event = "other calibration"
    covariate = "time × force"
    seen_in = "time"
    absent = "before the step"
    decided_by = "the position before the jump once more"
    cure = (
        "Fix the range of the device and switch off what calibrates it by itself; "
        "take the positions before the step again."
    )
    source = "judged: another range or calibration, 0.01 to 1 %"

    def chance(self, x: Experience) -> float:
        """Of three hundred sessions one has it."""
        return 3e-3

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """One from the instant on."""
        return step_course(x, shape["at_s"])
