"""Gyroscopes that feel products of rates about two axes.

    W_i += p_i1 w_x w_y + p_i2 w_y w_z + p_i3 w_x w_z

W output and w angular rate, rad/s, device axes; p s/rad. Source: Avrutov et al. 2017,
(4.1).

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, rate=np.array([[1.0, 2, 3]]))
>>> GyroProducts().design(x)[0, 4]
array([0., 0., 0., 2., 6., 3., 0., 0., 0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


class GyroProducts(Sensor):
    """Products of rates in the gyroscopes."""

    params = tuple(
        Param(f"p{i}{j}", "s/rad", 6e-3) for i in (1, 2, 3) for j in (1, 2, 3)
    )
    covariate = "products of rate about two axes"
    decided_by = "rates about two axes at once on a rate table"
    cure = "Turn about one axis at a time, or calibrate on a rate table."
    source = "Avrutov et al. 2017, (4.1); example 4: 1e-4 s/deg of the scale factor"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The three products on each output."""
        a, b, c = x.w.T
        terms = np.column_stack([a * b, b * c, a * c])  # (4.1)
        out = np.zeros((len(x), 6, 9))
        for i in range(3):
            out[:, 3 + i, 3 * i : 3 * i + 3] = terms
        return out
