"""Turns, the mounting of the device, and what its sensors experience at rest.

Procedure axes at home (all angles 0): x East, y down, z North, right-handed. The device
is turned by alpha about z, then by beta about the turned x, and where a third angle is
given, by gamma about the y that both have turned:

    A1 = [[ca, sa, 0], [-sa, ca, 0], [0, 0, 1]]                     (1)
    A2 = [[1, 0, 0], [0, cb, sb], [0, -sb, cb]]                     (2)
    A3 = [[cc, 0, -sc], [0, 1, 0], [sc, 0, cc]]
    A  = A3 A2 A1                                                   (3)
    f  = A (0, -g, 0)                                               (4)
    w  = A Omega (0, -sin phi, cos phi)                             (39)

f is specific force, m/s^2; w the Earth's rate, rad/s; phi the latitude. Source: Avrutov
and Pozniak 2023. The print has +sin phi in (39), which belongs to left-handed axes,
and -g cos(alpha) sin(beta) in the third line of (5); here the signs follow from
(1)-(3).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from fieldcal.core.errors import InputError
from fieldcal.core.rotation import logarithm
from fieldcal.core.samples import Array

EARTH_RATE = 7.292115e-5
"""Angular rate of the Earth, rad/s (WGS84)."""

UPRIGHT = 1e-9
"""Cosine of beta below which alpha and gamma turn about the same axis."""


def turn(alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike | None = None) -> Array:
    """Direction cosines from base to procedure axes after the turns, (..., 3, 3).

    Parameters
    ----------
    alpha, beta, gamma : rad, broadcast against each other; no third turn if not given

    >>> np.round(turn(0.0, np.pi / 2) @ [0, -1, 0], 12) + 0.0
    array([0., 0., 1.])
    """
    alpha, beta = np.broadcast_arrays(np.asarray(alpha, float), np.asarray(beta, float))
    columns = [in_turned_axes(alpha, beta, axis, gamma) for axis in np.eye(3)]
    return np.stack(columns, axis=-1)


def turns_of(matrix: ArrayLike) -> Array:
    """Angles alpha, beta, gamma, rad, of direction cosines (..., 3, 3), (..., 3).

    The inverse of `turn`; beta is in [-pi/2, pi/2]. Where it is a right angle alpha and
    gamma turn about one axis, and gamma is 0.

    >>> np.round(turns_of(turn(2.5, -0.4, -1.2)), 9).tolist()
    [2.5, -0.4, -1.2]
    """
    a = np.asarray(matrix, float)
    down = np.hypot(a[..., 1, 0], a[..., 1, 1])
    one = down < UPRIGHT  # axis for both
    alpha = np.where(
        one,
        np.arctan2(a[..., 0, 1], a[..., 0, 0]),
        np.arctan2(-a[..., 1, 0], a[..., 1, 1]),
    )
    gamma = np.where(one, 0.0, np.arctan2(-a[..., 0, 2], a[..., 2, 2]))
    return np.stack([alpha, np.arctan2(a[..., 1, 2], down), gamma], axis=-1)


def way(before: Array, alpha: Array, beta: Array) -> Array:
    """Rotation vectors from turns `before` (..., 3, 3) to others, (..., 3) rad.

    In procedure axes; the shortest way.

    >>> np.round(way(turn(0.0, 0.0), np.array([0.5]), np.zeros(1)), 12) + 0.0
    array([[0. , 0. , 0.5]])
    """
    return logarithm(before @ np.swapaxes(turn(alpha, beta), -1, -2))


def in_turned_axes(
    alpha: Array, beta: Array, vector: Array, gamma: ArrayLike | None = None
) -> Array:
    """A vector (3,) of base axes in procedure axes after the turns, (..., 3).

    As `turn` times the vector, where only that is wanted.

    >>> quarter = np.array([np.pi / 2])
    >>> np.round(in_turned_axes(np.zeros(1), quarter, [0, -1, 0]), 12) + 0.0
    array([[0., 0., 1.]])
    """
    x, y, z = vector
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    out, on = np.empty((*ca.shape, 3)), y * ca - x * sa
    out[..., 0] = x * ca + y * sa  # (3)
    out[..., 1] = on * cb + z * sb
    out[..., 2] = z * cb - on * sb
    return out if gamma is None else about_y(out, np.asarray(gamma, float))


def about_y(vector: Array, gamma: Array) -> Array:
    """Vectors (..., 3) in axes that are turned about y by gamma, rad; A3 of (3)."""
    c, s = np.cos(gamma), np.sin(gamma)
    x, y, z = np.moveaxis(vector, -1, 0)
    return np.stack([c * x - s * z, y + 0.0 * c, s * x + c * z], axis=-1)


def force_home(gravity: float) -> Array:
    """Specific force at rest in base axes, (3,) m/s^2: y points down."""
    return np.array([0.0, -gravity, 0.0])


def force(
    alpha: ArrayLike,
    beta: ArrayLike,
    gravity: float,
    gamma: ArrayLike | None = None,
) -> Array:
    """Specific force at rest in procedure axes, (..., 3) m/s^2, (4).

    >>> np.round(force(0.0, 0.0, 9.81), 3) + 0.0
    array([ 0.  , -9.81,  0.  ])
    """
    at_rest: Array = turn(alpha, beta, gamma) @ force_home(gravity)  # (4)
    return at_rest


def mean_rotation(rates: Array) -> Array:
    """Projection that averaging over whole turns makes of another rate, (n, 3, 3).

    Of a device that turns at `rates` (n, 3), components across the axis average to 0;
    of a device at rest all components remain.
    """
    speed = np.linalg.norm(rates, axis=1, keepdims=True)
    axis = np.divide(rates, speed, out=np.zeros_like(rates), where=speed > 0)
    left: Array = axis[:, :, None] * axis[:, None, :]
    left[speed[:, 0] == 0] = np.eye(3)
    return left


def earth_rate_home(latitude: float) -> Array:
    """Earth's rate in base axes, (3,) rad/s; `latitude` in rad, (38)."""
    return EARTH_RATE * np.array([0.0, -np.sin(latitude), np.cos(latitude)])  # (38)


def angles_of(direction: ArrayLike) -> tuple[float, float]:
    """Angles alpha, beta in rad at which the specific force is along `direction`.

    `direction` is (3,) in procedure axes, of any length. The inverse of (4), beta in
    (-pi/2, pi/2]: f = g (-sin a, -cos a cos b, cos a sin b).

    >>> [round(float(np.rad2deg(a)), 6) for a in angles_of(force(0.5, 0.1, 9.81))]
    [28.64789, 5.729578]
    """
    x, y, z = np.asarray(direction, float)
    beta = np.arctan2(z, -y)
    if abs(beta) > np.pi / 2:
        beta -= np.copysign(np.pi, beta)
    alpha = np.arctan2(-x, z * np.sin(beta) - y * np.cos(beta))
    return float(alpha), float(beta)


def mounting_matrix(axes: Sequence[str]) -> Array:
    """Signed permutation P, procedure = P @ device, from names such as ``"-z"``.

    Element i names the device axis that lies along procedure axis i. A z-up unit is
    ``["+x", "-z", "+y"]``.

    Raises
    ------
    InputError
        If the names are not three different signed axes, or make a left-handed frame.

    >>> mounting_matrix(["+x", "-z", "+y"]) @ [0, 0, 9.81]
    array([ 0.  , -9.81,  0.  ])
    """
    matrix = np.zeros((3, 3))
    if len(axes) != 3 or any(not re.fullmatch(r"[+-]?[xyz]", a) for a in axes):
        raise InputError(
            f'mounting {list(axes)} is not three signed axes such as ["+x", "-z", "+y"]'
        )
    for row, name in enumerate(axes):
        matrix[row, "xyz".index(name[-1])] = -1.0 if name[0] == "-" else 1.0
    if round(float(np.linalg.det(matrix))) != 1:
        raise InputError(
            f"mounting {list(axes)} is not a right-handed frame: name each axis once, "
            "and check the signs against the drawing on the device"
        )
    return matrix
