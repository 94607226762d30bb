"""A strap-down navigator of its own: Earth-centred axes, matrices, numpy alone.

It is given samples of rates and forces, an attitude to begin with, and a place, and
integrates in Earth-fixed axes, so that nothing here has the form of what estimates.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

OMEGA = 7.292115e-5
A, E2 = 6378137.0, 6.69437999014e-3
"""WGS 84."""


def local_axes(latitude: float, longitude: float) -> Array:
    """Columns: East, down, north in Earth-centred axes."""
    sp, cp, sl, cl = (
        np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude),
    )  # fmt: skip
    east = [-sl, cl, 0.0]
    down = [-cp * cl, -cp * sl, -sp]
    north = [-sp * cl, -sp * sl, cp]
    return np.array([east, down, north]).T


def place(latitude: float, height: float) -> Array:
    """Earth-centred position at longitude 0, m."""
    n = A / np.sqrt(1 - E2 * np.sin(latitude) ** 2)
    x = (n + height) * np.cos(latitude)
    return np.array([x, 0.0, (n * (1 - E2) + height) * np.sin(latitude)])


def _skew(v: Array) -> Array:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    o = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((o, -z, y), (z, o, -x), (-y, x, o))]
    return np.asarray(np.stack(rows, axis=-2))


def _rotation(v: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) that are not zero."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    k = _skew(v) / angle
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)


def navigated(
    rates: Array,
    forces: Array,
    dt: float,
    attitude: Array,
    latitude: float,
    gravity: float,
) -> tuple[Array, Array]:
    """Velocity and way, (n, 3) East, down, north, of a navigator that is let go.

    Parameters
    ----------
    rates, forces : (n, 3) of samples, device axes
    dt : s
    attitude : (3, 3) that it is told, from device to East, down, north
    latitude : rad
    gravity : m/s^2 at the start; it knows that gravity grows weaker with height

    """
    home = local_axes(latitude, 0.0)
    start = place(latitude, 0.0)
    c, v, r = home @ attitude, np.zeros(3), start.copy()
    earth = np.array([0.0, 0.0, OMEGA])
    velocities, ways = np.empty_like(forces), np.empty_like(forces)
    radius = float(np.linalg.norm(start))
    half_turns, turns = _rotation(rates * dt / 2), _rotation(rates * dt)
    half_back, back = _rotation(-earth * dt / 2), _rotation(-earth * dt)
    coriolis = 2 * _skew(earth)
    for k, f in enumerate(forces):
        middle = half_back @ c @ half_turns[k]
        c = back @ c @ turns[k]
        way = r - start
        up = -home[:, 1]
        # plumb line follows the place; gravity as of a sphere about it
        plumb = up + (way - up * (up @ way)) / radius
        plumb /= np.linalg.norm(plumb)
        pull = -gravity * (1 - 2 * (up @ way) / radius) * plumb
        v = v + (middle @ f + pull - coriolis @ v) * dt
        r = r + v * dt
        velocities[k], ways[k] = home.T @ v, home.T @ (r - start)
    return velocities, ways
