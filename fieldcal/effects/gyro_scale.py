"""Gyroscope scale factor off, seen in the angle of a turn between two positions.

    W_i += s_i w_i

W output and w angular rate, rad/s, device axes; s_i dimensionless: the change of the
scale factor from the nominal one. Source: Avrutov et al. 2017, (3.1).

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, rate=np.array([[0, 0, 0.5]]))
>>> GyroScale().design(x)[0, 3:]
array([[0. , 0. , 0. ],
       [0. , 0. , 0. ],
       [0. , 0. , 0.5]])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class GyroScale(Sensor):
    """Scale factor of the gyroscopes."""

    params = tuple(Param(f"s{i}", "1", 3e-2) for i in (1, 2, 3))
    carried_by = "gyr_scale"
    usual = True
    covariate = "angle turned"
    decided_by = "a turn about each axis in turn, by 90° or more"
    cure = (
        "Apply the scale factors of the gyroscopes that solve states; it estimates"
        " them from the turns (if it states none, --turns yes)."
    )
    source = "Avrutov et al. 2017, (3.1); MEMS data sheets state 0.1 to 3 %"

    def applies(self, x: Experience) -> bool:
        """Where no table turns the device: there it is always estimated."""
        return not x.rate.any()

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Rate about the output's own axis."""
        out = np.zeros((len(x), 6, 3))
        for i in range(3):
            out[:, 3 + i, i] = x.w[:, i]
        return out
