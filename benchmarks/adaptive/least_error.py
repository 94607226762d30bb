"""The least error of the force that a number of positions of the ladder can leave.

An accelerometer with bias b, scale factor k and cross-coupling c on a tilted base,

    y = b + k f + c f' + noise,    R = w^2 + (s df/dangle)^2                        (1)
    S = (P^-1 + sum J^T R^-1 J)^-1,    e^2 = mean of the trace of H S H^T           (2)

in m/s^2, with J the derivatives of a position's means by all that is unknown, P what a
device may have, w noise of a window, s how well angles are set, and H the derivatives
of the force in positions that were not taken by b and k. Of all sets of as many
positions the best one counts: no choice on the way can leave less, on average.
Source: least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations

import numpy as np

from fieldcal.core.frames import in_procedure_axes
from fieldcal.core.samples import Array

G = 9.81
"""m/s^2."""

NOISE = 1e-3
"""Of the mean of a window, with what a bias wanders by, m/s^2."""

BIAS, SCALE, TILT, CROSSED = 0.3, 1e-2, 5e-2, 5e-4
"""What a device and its base may have, 1 sigma: m/s^2, 1, rad, 1."""

STEP = 1e-6
"""Change of an angle for a derivative, rad."""

Place = tuple[float, float]


def error(taken: Sequence[Place], apart: Sequence[Place], angles_deg: float) -> float:
    """Rms of the force in positions apart after some were taken, m/s^2, (2)."""
    every = sum(_information(place, angles_deg) for place in taken)
    return float(_left(np.asarray(every)[None], apart)[0])


def least(
    count: int,
    first: Sequence[Place],
    ladder: Sequence[Place],
    apart: Sequence[Place],
    angles_deg: float,
) -> float:
    """The same of the best set of `count` positions that begins with the first."""
    rest = [place for place in ladder if place not in first]
    known = np.array([_information(place, angles_deg) for place in rest])
    begun = sum(_information(place, angles_deg) for place in first)
    sets = np.array(list(combinations(range(len(rest)), count - len(first))))
    return float(_left(begun + known[sets].sum(axis=1), apart).min())


def _left(information: Array, apart: Sequence[Place]) -> Array:
    """Rms of the force that some information (n, k, k) leaves, (n,) m/s^2."""
    prior = np.repeat([BIAS, SCALE, TILT, CROSSED], [3, 3, 2, 6]) ** -2.0
    covariance = np.linalg.inv(information + np.diag(prior))
    rows = np.concatenate([_derivatives(place) for place in apart])
    rows[:, 6:] = 0.0  # a tilt is the base's, and cross-coupling is left as it is
    out: Array = np.sqrt(np.einsum("ri,nij,rj->n", rows, covariance, rows) / len(rows))
    return out


def _information(place: Place, angles_deg: float) -> Array:
    """J^T R^-1 J of one position, (14, 14), (1)."""
    rows = _derivatives(place)
    a, b = np.deg2rad(place)
    there = _force(a, b)
    moved = np.stack([_force(a + STEP, b) - there, _force(a, b + STEP) - there], axis=1)
    moved *= np.deg2rad(angles_deg) / STEP
    out: Array = rows.T @ np.linalg.solve(NOISE**2 * np.eye(3) + moved @ moved.T, rows)
    return out


def _derivatives(place: Place) -> Array:
    """J of one position by biases, scale factors, tilts and cross-coupling, (3, 14)."""
    a, b = np.deg2rad(place)
    force = _force(a, b)
    tilted = [(_force(a, b, t) - force) / STEP for t in ((STEP, 0.0), (0.0, STEP))]
    crossed = np.zeros((3, 6))
    for column, (i, j) in enumerate(permutations(range(3), 2)):
        crossed[i, column] = force[j]
    return np.hstack([np.eye(3), np.diag(force), np.transpose(tilted), crossed])


def _force(alpha: float, beta: float, tilt: Place = (0.0, 0.0)) -> Array:
    """Specific force on a base that is tilted about x and z, (3,)."""
    up = np.array([0.0, -G, 0.0])
    up = up + np.cross([tilt[0], 0.0, tilt[1]], up)
    return in_procedure_axes(np.array(alpha), np.array(beta), up)
