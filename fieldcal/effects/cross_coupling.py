"""Accelerometer axes that are not square: each also feels force along the others.

    U_i += sum over j != i of k_ij f_j

Where nobody knows how the device stood, its axes are those of the accelerometers: z is
that of az, and ay lies in the plane of y and z; k21, k31 and k32 are zero.

U output and f specific force, m/s^2, device axes; k_ij, dimensionless, is the response
of the accelerometer i to force along j. Source: Avrutov and Pozniak 2023, (6).

>>> import numpy as np
>>> x = Experience.at_rest(np.array([0.0]), np.array([0.0]), 10.0)  # f = (0, -10, 0)
>>> CrossCoupling().design(x)[0, :3].T @ [1, 10, 100]  # k12 and k32 see -10
array([  -10.,     0.,     0.,     0.,     0., -1000.])
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Param, Sensor
from fieldcal.physics.experience import Experience

PAIRS = [(i, j) for i in range(3) for j in range(3) if i != j]


class CrossCoupling(Sensor):
    """Cross-coupling of the accelerometers."""

    params = tuple(Param(f"k{i + 1}{j + 1}", "1", 2e-2) for i, j in PAIRS)
    turned_into = {f"k{i + 1}{j + 1}": f"k{j + 1}{i + 1}" for i, j in PAIRS if j < i}
    usual = True
    covariate = "force along the other axes"
    decided_by = "positions that load each axis alone, up and down"
    cure = "Solve with --cross: the coefficients go into the calibration."
    source = "Avrutov and Pozniak 2023, (6); MEMS data sheets state 0.1 to 2 %"

    def design(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """Force along j on the output i."""
        out = np.zeros((len(x), 6, len(PAIRS)))
        for column, (i, j) in enumerate(PAIRS):
            out[:, i, column] = x.f[:, j]
        return out
