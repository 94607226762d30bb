"""Rotations, mounting of the device, specific force and Earth's rate at rest.

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
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fieldcal.core.errors import InputError
from fieldcal.core.rotation import rotation_vectors
from fieldcal.core.samples import Array

EARTH_RATE = 7.292115e-5
"""Angular rate of the Earth, rad/s (WGS84)."""

GIMBAL_LOCK = 1e-9
"""Cosine of beta below which alpha and gamma turn about the same axis."""


def wrap_angle(angle: Array, turn: float = 2 * np.pi) -> Array:
    """Angles within half a turn either way, in the unit of a whole `turn`.

    >>> wrap_angle(np.array([190.0, -180.0, 30.0]), 360.0)
    array([-170., -180.,   30.])
    """
    wrapped: Array = (angle + turn / 2) % turn - turn / 2
    return wrapped


def direction_cosines(
    alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike | None = None
) -> Array:
    """Direction cosines from base to procedure axes after the turns, (..., 3, 3).

    Parameters
    ----------
    alpha, beta, gamma : rad, broadcast against each other; no third turn if not given

    >>> np.round(direction_cosines(0.0, np.pi / 2) @ [0, -1, 0], 12) + 0.0
    array([0., 0., 1.])
    """
    alpha, beta = np.broadcast_arrays(np.asarray(alpha, float), np.asarray(beta, float))
    columns = each_in_procedure_axes(alpha, beta, np.eye(3), gamma)
    return np.stack(columns, axis=-1)


def angles_of_direction_cosines(matrix: ArrayLike) -> Array:
    """Angles alpha, beta, gamma, rad, of direction cosines (..., 3, 3), (..., 3).

    The inverse of `direction_cosines`; beta is in [-pi/2, pi/2]. Where it is a right
    angle, alpha and gamma turn about one axis, and gamma is 0.

    >>> matrix = direction_cosines(2.5, -0.4, -1.2)
    >>> np.round(angles_of_direction_cosines(matrix), 9).tolist()
    [2.5, -0.4, -1.2]
    """
    a = np.asarray(matrix, float)
    down = np.hypot(a[..., 1, 0], a[..., 1, 1])
    one = down < GIMBAL_LOCK  # axis for both
    alpha = np.where(
        one,
        np.arctan2(a[..., 0, 1], a[..., 0, 0]),
        np.arctan2(-a[..., 1, 0], a[..., 1, 1]),
    )
    gamma = np.where(one, 0.0, np.arctan2(-a[..., 0, 2], a[..., 2, 2]))
    return np.stack([alpha, np.arctan2(a[..., 1, 2], down), gamma], axis=-1)


def shortest_rotation(before: Array, alpha: Array, beta: Array) -> Array:
    """Rotation vectors from attitudes `before` (..., 3, 3) to others, (..., 3) rad.

    In procedure axes; of the two ways round, the shorter one.

    >>> home = direction_cosines(0.0, 0.0)
    >>> np.round(shortest_rotation(home, np.array([0.5]), np.zeros(1)), 12) + 0.0
    array([[0. , 0. , 0.5]])
    """
    return rotation_vectors(
        before @ np.swapaxes(direction_cosines(alpha, beta), -1, -2)
    )


def in_procedure_axes(
    alpha: Array, beta: Array, vector: Array, gamma: ArrayLike | None = None
) -> Array:
    """A vector (3,) of base axes in procedure axes after the turns, (..., 3).

    Equal to `direction_cosines` times the vector, without making the matrices.

    >>> quarter = np.array([np.pi / 2])
    >>> np.round(in_procedure_axes(np.zeros(1), quarter, [0, -1, 0]), 12) + 0.0
    array([[0., 0., 1.]])
    """
    return each_in_procedure_axes(alpha, beta, [vector], gamma)[0]


def each_in_procedure_axes(
    alpha: Array,
    beta: Array,
    vectors: Iterable[ArrayLike],
    gamma: ArrayLike | None = None,
) -> list[Array]:
    """Several vectors (3,) as by `in_procedure_axes`, each (..., 3)."""
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    found = []
    for x, y, z in np.asarray([*vectors], float):
        out, on = np.empty((*ca.shape, 3)), y * ca - x * sa
        out[..., 0] = x * ca + y * sa  # (3)
        out[..., 1] = on * cb + z * sb
        out[..., 2] = z * cb - on * sb
        found.append(out)
    if gamma is None:
        return found
    third = np.asarray(gamma, float)
    return [in_axes_turned_about_y(vector, third) for vector in found]


def in_axes_turned_about_y(vector: Array, gamma: Array) -> Array:
    """Vectors (..., 3) in axes that are turned about y by gamma, rad; A3 of (3)."""
    c, s = np.cos(gamma), np.sin(gamma)
    x, y, z = np.moveaxis(vector, -1, 0)
    return np.stack([c * x - s * z, y + 0.0 * c, s * x + c * z], axis=-1)


def specific_force_at_home(gravity: float) -> Array:
    """Specific force at rest in base axes, (3,) m/s^2: y points down."""
    return np.array([0.0, -gravity, 0.0])


def specific_force_at_rest(
    alpha: ArrayLike,
    beta: ArrayLike,
    gravity: float,
    gamma: ArrayLike | None = None,
) -> Array:
    """Specific force at rest in procedure axes, (..., 3) m/s^2, (4).

    >>> np.round(specific_force_at_rest(0.0, 0.0, 9.81), 3) + 0.0
    array([ 0.  , -9.81,  0.  ])
    """
    at_rest: Array = direction_cosines(alpha, beta, gamma) @ specific_force_at_home(
        gravity
    )  # (4)
    return at_rest


def axis_projections(rates: Array) -> Array:
    """Projection matrices on the axis about which the device turns, (n, 3, 3).

    Averaged over whole turns at `rates` (n, 3), only the component of another vector
    along that axis remains. For a device at rest the matrix is the identity.
    """
    speed = np.linalg.norm(rates, axis=1, keepdims=True)
    axis = np.divide(rates, speed, out=np.zeros_like(rates), where=speed > 0)
    left: Array = axis[:, :, None] * axis[:, None, :]
    left[speed[:, 0] == 0] = np.eye(3)
    return left


def earth_rate_at_home(latitude: float) -> Array:
    """Earth's rate in base axes, (3,) rad/s; `latitude` in rad, (38)."""
    return EARTH_RATE * np.array([0.0, -np.sin(latitude), np.cos(latitude)])  # (38)


def angles_of_force_direction(direction: ArrayLike) -> tuple[float, float]:
    """Angles alpha, beta in rad at which the specific force is along `direction`.

    `direction` is (3,) in procedure axes, of any length. The inverse of (4), beta in
    (-pi/2, pi/2]: f = g (-sin a, -cos a cos b, cos a sin b).

    >>> force = specific_force_at_rest(0.5, 0.1, 9.81)
    >>> [round(float(np.rad2deg(a)), 6) for a in angles_of_force_direction(force)]
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
