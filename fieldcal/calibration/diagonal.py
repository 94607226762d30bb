"""A calibration reduced to bias and scale factor, and the error that this makes.

    U = b + M f,  D = diag M                                                       (1)
    D^-1 (U - b) - f = (D^-1 M - I) f                                              (2)
    e_i = |row i of (D^-1 M - I)| |f|      largest error over all directions of f  (3)

Symbols: U raw, f true, b bias, M scale factors and cross-coupling. Device axes. Formats
without room for cross-coupling keep b and D; (3) is the error that this makes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.calibration.parameters import Calibration, Nominal
from fieldcal.core.samples import Array


class DiagonalCalibration(NamedTuple):
    """Bias and scale factor of three axes.

    Attributes
    ----------
    bias, scale : (3,) of U = bias + scale f, SI
    cross_coupling_error : (3,) error without the cross-coupling, as a share of |f|, (3)

    """

    bias: Array
    scale: Array
    cross_coupling_error: Array


def reduce_to_diagonal(
    calibration: Calibration, sensor: str, nominal: Nominal | None = None
) -> DiagonalCalibration:
    """Reduce the calibration of one sensor to bias and scale factor.

    Parameters
    ----------
    calibration : calibration of the device
    sensor : ``"acc"`` or ``"gyr"``
    nominal : values for what was not determined; bias 0 and scale 1 if not given

    """
    start = nominal or Nominal()
    bias, matrix = (
        calibration.accelerometers(start)
        if sensor == "acc"
        else calibration.gyroscopes(start)
    )
    scale = np.diag(matrix).copy()
    rest = matrix / scale[:, None] - np.eye(3)  # (2)
    return DiagonalCalibration(bias, scale, np.linalg.norm(rest, axis=1))  # (3)
