"""How the device lies in each row: angles that are known, or what it reads instead."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.positions import (
    Position,
    angles,
    attitude_sigmas,
    speeds,
    third_angles,
)
from fieldcal.core.samples import Array
from fieldcal.model.rows.turntable import Readings
from fieldcal.session.description import Description


def known_angles(about: Description, position: NDArray[np.intp]) -> tuple[Array, Array]:
    """Both angles of each row, (n,) each, rad; nan where nobody knows them."""
    if not about.positions:
        unknown = np.full(len(position), np.nan)
        return unknown, unknown
    alpha, beta = angles(about.positions)
    return alpha[position], beta[position]


def known_attitudes(about: Description, position: NDArray[np.intp]) -> dict[str, Array]:
    """The third turn of each row, how well its position is known, and its speed."""
    if not about.positions:
        return {}
    positions = about.positions
    return {
        "gamma": third_angles(positions)[position],
        "attitude_sigma": attitude_sigmas(positions)[position],
        "speed": speeds(positions)[0][position],
        "speed_sigma": speeds(positions)[1][position],
    }


def readings(about: Description, position: NDArray[np.intp], gyr: Array) -> Readings:
    """What gyroscopes read in each row, by their outputs (n, 3), nan where unknown."""
    w = (gyr - about.nominal["gyr_bias"]) / about.nominal["gyr_scale"]
    positions = about.positions or (Position("all of it"),) * (int(position.max()) + 1)
    return Readings(positions, position, w, float(np.linalg.norm(about.base_rate)))


def force_read(about: Description, position: NDArray[np.intp], acc: Array) -> Array:
    """Force along what accelerometers read, by their outputs (n, 3), m/s^2."""
    apart = (acc - about.nominal["acc_bias"]) / about.nominal["acc_scale"]
    return free_force(about.gravity, position, apart)


def free_force(gravity: float, position: NDArray[np.intp], f: Array) -> Array:
    """Force of length g along what is read in each position, (n, 3)."""
    out = np.zeros((len(position), 3))
    for p in np.unique(position):
        mean = np.nanmean(np.nan_to_num(f[position == p]), axis=0)
        out[position == p] = gravity * mean / max(np.linalg.norm(mean), 1e-12)
    return out
