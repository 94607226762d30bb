"""Attitude of a [[position]] in session.toml: angles, a rotation, or nothing.

    alpha_deg, beta_deg, gamma_deg    turns about z, the turned x, the turned y
    rotation_vector_deg               one turn from home, about x, y, z of the base
    quaternion                        the same turn, w x y z

The last two rotate the procedure axes from home to the position, in base axes (x East,
y down, z North). All are converted to the three angles of `Position`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.frames import angles_of_direction_cosines
from fieldcal.core.positions import Position

ATTITUDE_KEYS = ("alpha_deg", "rotation_vector_deg", "quaternion")

ANGLE_KEYS = ("alpha_deg", "beta_deg", "gamma_deg")

WHOLE_TURN_DEG, MAX_TURNS = 360.0, 2
"""And the largest number of turns that an angle is: joints count on beyond one."""

OTHER_TURNS = {"gon": 400.0, "mrad": 2000 * np.pi, "mil": 6400.0}
"""A whole turn in other units that angles are written in."""

LENGTH_TOLERANCE = 0.01
"""Difference of a quaternion's length from 1 that is taken for rounding."""


def parse_attitude(number: int, table: Mapping[str, Any], name: str) -> Position:
    """Position that a [[position]] table states.

    Parameters
    ----------
    number : of the position, from 1
    table : of session.toml
    name : shown to the operator; may be empty

    Raises
    ------
    InputError
        If it states two attitudes, an angle beyond two turns, or something that is
        no rotation.

    """
    given = [form for form in ATTITUDE_KEYS if form in table]
    if len(given) > 1:
        raise InputError(
            f"[[position]] number {number} has {given[0]} and {given[1]}: give one of"
            " them"
        )
    if not given:
        position = Position(name or f"position {number}")
    elif given[0] == "alpha_deg":
        alpha, beta, third = (_angle(number, key, table) for key in ANGLE_KEYS)
        position = Position.deg(alpha, beta, name, gamma=third)
    else:
        turned = _rotation(number, given[0], np.array(table[given[0]], dtype=float))
        degrees = np.rad2deg(angles_of_direction_cosines(turned.T)).round(9) + 0.0
        alpha, beta, gamma = degrees.tolist()
        position = Position.deg(alpha, beta, name, gamma=gamma)
    sigma = table.get("attitude_sigma_deg")
    if sigma is None:
        return position
    if not given:
        raise InputError(
            f"[[position]] number {number} has attitude_sigma_deg and no attitude: give"
            " both, or neither"
        )
    return replace(position, sigma=float(np.deg2rad(sigma)))


def _angle(number: int, key: str, table: Mapping[str, Any]) -> float:
    """An angle, deg; 0 where it is not stated."""
    angle = float(table.get(key, 0.0))
    if abs(angle) > MAX_TURNS * WHOLE_TURN_DEG:
        degrees = [
            f"{angle * WHOLE_TURN_DEG / turn:.4g}° if it is in {unit}"
            for unit, turn in OTHER_TURNS.items()
        ]
        raise InputError(
            f"[[position]] number {number} {key} = {angle:g} is more than two turns:"
            f" give it in degrees; it is {', '.join(degrees)}"
        )
    return angle


def _rotation(number: int, form: str, values: np.ndarray) -> np.ndarray:
    """Matrix (3, 3) of an active rotation in base axes."""
    from scipy.spatial.transform import Rotation  # a quarter of a second to import

    if form == "rotation_vector_deg":
        matrix: np.ndarray = Rotation.from_rotvec(values, degrees=True).as_matrix()
        return matrix
    length = float(np.linalg.norm(values))
    if not abs(length - 1) <= LENGTH_TOLERANCE:
        raise InputError(
            f"[[position]] number {number} quaternion has length {length:.4g}: give w x"
            " y z of a turn, whose length is 1"
        )
    w, x, y, z = values
    matrix = Rotation.from_quat([x, y, z, w]).as_matrix()
    return matrix
