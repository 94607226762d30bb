"""Orientation in each row: known angles, or else what the sensors measure."""

from __future__ import annotations

import numpy as np

from fieldcal.core.positions import (
    Position,
    alpha_beta_angles,
    attitude_sigmas,
    gamma_angles,
    unknown_axis_speeds,
)
from fieldcal.core.samples import Array, Index
from fieldcal.model.rows.block_means import mean_of_known
from fieldcal.model.rows.turntable import GyroReadings
from fieldcal.session.description import Description


def known_angles(about: Description, position: Index) -> tuple[Array, Array]:
    """Both angles of each row, (n,) each, rad; nan where unknown."""
    if not about.positions:
        unknown = np.full(len(position), np.nan)
        return unknown, unknown
    alpha, beta = alpha_beta_angles(about.positions)
    return alpha[position], beta[position]


def known_attitudes(about: Description, position: Index) -> dict[str, Array]:
    """The third turn of each row, how well its position is known, and its speed."""
    if not about.positions:
        return {}
    positions = about.positions
    return {
        "gamma": gamma_angles(positions)[position],
        "attitude_sigma": attitude_sigmas(positions)[position],
        "speed": unknown_axis_speeds(positions)[0][position],
        "speed_sigma": unknown_axis_speeds(positions)[1][position],
    }


def gyro_readings(about: Description, position: Index, gyr: Array) -> GyroReadings:
    """Angular rates by the gyroscopes' outputs (n, 3), nominally calibrated."""
    w = (gyr - about.nominal["gyr_bias"]) / about.nominal["gyr_scale"]
    positions = about.positions or (Position("all of it"),) * (int(position.max()) + 1)
    return GyroReadings(positions, position, w, float(np.linalg.norm(about.base_rate)))


def force_from_outputs(about: Description, position: Index, acc: Array) -> Array:
    """Force of length g along the mean of each position's outputs (n, 3), m/s^2."""
    apart = (acc - about.nominal["acc_bias"]) / about.nominal["acc_scale"]
    return force_along_mean(about.gravity, position, apart)


def force_along_mean(gravity: float, position: Index, f: Array) -> Array:
    """Force of length g along the mean of each position's force `f`, (n, 3).

    The mean is over the rows that an axis was measured in: an axis may lack some.
    """
    out = np.zeros((len(position), 3))
    for p in np.unique(position):
        mean = np.nan_to_num(mean_of_known(f[position == p]))
        out[position == p] = gravity * mean / max(float(np.linalg.norm(mean)), 1e-12)
    return out
