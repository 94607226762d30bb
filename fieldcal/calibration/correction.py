"""Calibrated samples and their standard uncertainty.

    U = b + M f,  f = M^-1 (U - b)
    df = -M^-1 (db + dM f),  cov f = J C J^T

U raw and f true, (n, 3), device axes; C the covariance of the parameters in b and M.
Large arrays are calculated in pieces that stay in the processor's cache: the
subtraction then costs little compared with the product.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration.names import ParameterName
from fieldcal.core.samples import Array

PIECE = 16384
"""Number of rows that are calculated at once."""


def calibrated_samples(raw: Array, bias: Array, matrix: Array) -> Array:
    """Calibrated values of raw samples, (n, 3).

    Parameters
    ----------
    raw : (n, 3)
    bias, matrix : (3,), (3, 3)

    """
    inverse = np.linalg.inv(matrix)
    turned = np.ascontiguousarray(inverse.T)
    # one long row instead of rows of three, which numpy would take one by one
    offset = np.tile(inverse @ bias, min(PIECE, len(raw)))
    out = np.empty((len(raw), 3))
    for first in range(0, len(raw), PIECE):
        part = out[first : first + PIECE]
        np.matmul(raw[first : first + PIECE], turned, out=part)
        flat = part.reshape(-1)
        np.subtract(flat, offset[: len(flat)], out=flat)
    return out


def calibrated_sigma(
    raw: Array,
    bias: Array,
    matrix: Array,
    names: Sequence[str],
    covariance: Array,
    sensor: str,
) -> Array:
    """Standard uncertainty of calibrated values, (n, 3).

    Parameters
    ----------
    raw : (n, 3)
    bias, matrix : (3,), (3, 3)
    names, covariance : all parameters of the calibration, (k,), (k, k)
    sensor : ``"acc"`` or ``"gyr"``

    """
    inverse = np.linalg.inv(matrix)
    true = calibrated_samples(raw, bias, matrix)
    known = [
        (i, *place) for i, n in enumerate(names) if (place := _matrix_place(n, sensor))
    ]
    rows = [i for i, *_ in known]
    variance = np.zeros((len(raw), 3))
    c = covariance[np.ix_(rows, rows)]
    # 1 in front of f: the bias is a coefficient of 1, an entry of M one of f_j
    factor = np.hstack([np.ones((len(raw), 1)), true])
    for j in range(4):
        for k in range(4):
            at_j = [a for a, (_, _, column) in enumerate(known) if column == j]
            at_k = [a for a, (_, _, column) in enumerate(known) if column == k]
            left = inverse[:, [known[a][1] for a in at_j]]
            right = inverse[:, [known[a][1] for a in at_k]]
            part = np.einsum("ia,ab,ib->i", left, c[np.ix_(at_j, at_k)], right)
            variance += (factor[:, j] * factor[:, k])[:, None] * part
    return np.sqrt(np.maximum(variance, 0.0))


def _matrix_place(name: str, sensor: str) -> tuple[int, int] | None:
    """Row of a parameter, and 0 for the bias or 1 + column of the matrix."""
    parameter = ParameterName.of(name)
    cross = "cross_coupling" if sensor == "acc" else "gyro_cross_coupling"
    if parameter.group == f"{sensor}_bias":
        return parameter.axis, 0
    if parameter.group == f"{sensor}_scale":
        return parameter.axis, 1 + parameter.axis
    if parameter.group == cross:
        row, column = parameter.entry
        return row, 1 + column
    return None
