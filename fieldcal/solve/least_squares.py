"""Least squares over n known rates of a table, as printed.

    gyroscopes                W = B + M1 w                                        (3.1)

One row of the matrix G is (1, w), and the solution is X = (G^T G)^-1 G^T W (3.3), the
Earth's rate left in W. w in rad/s, B and M1 in device axes. Source: Avrutov, Sapegin,
Stefanishin, Tsisarzh 2017; its accelerometers and products of axes are the model's.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import GYR
from fieldcal.solve.closed_form import ClosedFormEstimate
from fieldcal.solve.observations import Observations
from fieldcal.solve.rank import determined_parameters


def gyroscopes(observations: Observations) -> ClosedFormEstimate:
    """Bias, scale factor, cross-coupling, (3.3)."""
    g = np.column_stack([np.ones(len(observations)), observations.rates])
    known, _ = determined_parameters(g)
    inverse = np.linalg.pinv(g[:, known])  # (3.3)
    gain = np.einsum("kn,cd->kcnd", inverse, np.eye(3)).reshape(-1, len(g), 3)
    kept = [n for row, k in zip(_names(), known, strict=True) if k for n in row]
    return ClosedFormEstimate.of(kept, gain, observations, GYR)


def _names() -> list[list[str]]:
    """Full names, one row a column of G, one column a channel."""
    cross = "gyro_cross_coupling.s{}{}"
    table = [[f"gyr_bias.{axis}" for axis in "xyz"]]
    for j in range(3):
        row = [cross.format(i + 1, j + 1) for i in range(3)]
        row[j] = f"gyr_scale.{'xyz'[j]}"
        table.append(row)
    return table
