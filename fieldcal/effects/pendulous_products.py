"""Pendulous accelerometers: force along two axes at once leaves a product.

    U_i += l_i1 f_x f_y + l_i2 f_y f_z + l_i3 f_x f_z

U and f m/s^2, device axes; l 1/(m/s^2). Source: Avrutov et al. 2017, (2.1).

>>> import numpy as np
>>> x = Experience.at_rest(np.array([np.pi / 4]), np.zeros(1), 10.0)
>>> np.round(PendulousProducts().design(x)[0, 0, :3], 6) + 0.0  # f_x f_y = 7.07^2
array([50.,  0.,  0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience


def axis_products(v: Array) -> Array:
    """Products xy, yz, xz of vectors, (n, 3)."""
    x, y, z = v.T
    return np.column_stack([x * y, y * z, x * z])  # (2.1)


class PendulousProducts(Sensor):
    """Products of forces in the accelerometers."""

    params = tuple(
        Param(f"l{i}{j}", "1/(m/s^2)", 1e-4) for i in (1, 2, 3) for j in (1, 2, 3)
    )
    covariate = "products of force along two axes"
    decided_by = "positions that load two axes at once, with either sign"
    cure = (
        "Use the calibration that diagnose gives with it; positions that load "
        "two axes at once sharpen it."
    )
    source = "Avrutov et al. 2017, (2.1); up to 1e-4"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """The three products on each output."""
        out = np.zeros((len(x), 6, 9))
        for i in range(3):
            out[:, i, 3 * i : 3 * i + 3] = axis_products(x.f)
        return out
