"""Gyroscope axes that are not square: each also feels rotation about the others.

    W_i += sum over j != i of s_ij w_j

W output and w angular rate, rad/s, device axes; s_ij dimensionless. Seen in turns from
one position to another, and on a rate table. Source: Avrutov et al. 2017, (3.1).

>>> import numpy as np
>>> x = Experience.at_rest(np.zeros(1), np.zeros(1), 9.8, rate=np.array([[2.0, 0, 0]]))
>>> GyroCrossCoupling().design(x)[0, 4]  # the y gyroscope sees s21 times 2 rad/s
array([0., 0., 2., 0., 0., 0.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience

PAIRS = [(i, j) for i in range(3) for j in range(3) if i != j]


class GyroCrossCoupling(Sensor):
    """Cross-coupling of the gyroscopes."""

    params = tuple(Param(f"s{i + 1}{j + 1}", "1", 2e-2) for i, j in PAIRS)
    turned_by = {
        f"s{i + 1}{j + 1}": (
            "cross_coupling",
            f"k{max(i, j) + 1}{min(i, j) + 1}",
            1.0 if i < j else -1.0,
        )
        for i, j in PAIRS
    }
    usual = True
    covariate = "rate about the other axes"
    decided_by = "a turn about each axis in turn, by 90° or more"
    cure = (
        "Apply the cross-coupling of the gyroscopes that solve states, by the turns"
        " (if it states none, --turns yes) or by a rate table."
    )
    source = "Avrutov et al. 2017, (3.1); MEMS data sheets state 0.1 to 2 %"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Rate about j on the output i."""
        out = np.zeros((len(x), 6, len(PAIRS)))
        for column, (i, j) in enumerate(PAIRS):
            out[:, 3 + i, column] = x.w[:, j]
        return out
