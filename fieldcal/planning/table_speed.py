"""Predicted uncertainty of gyroscopes on a table of known speed and unknown axis.

The length of the rate measured by a gyroscope triad is the speed v of the table. For
spins i with the table's axis along u_i of the device (n, 3), and small errors of biases
b and scale factors s,

    |w_i| - v = sum_j u_ij b_j + v u_ij^2 (s_j - 1) + e_i + d                      (1)

e is the error of a mean; d is common to all spins: the error of the speed, and the
component of the Earth's rate along the axis, which is the same anywhere on the table.
Between the spins the device rests in any orientation and shows its biases, together
with the Earth's rate W, of which W / sqrt(3) is in each axis:

    m_rj = b_j + e_rj + W_rj                                                       (2)

    C = (J^T R^-1 J)^-1                                         Cramer-Rao bound

Source: the scalar method, as for accelerometers; Avrutov 2010. SI units.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from fieldcal.core.errors import PlanError
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import Array
from fieldcal.planning.planner import parameter_sigma

NAMES = tuple(f"gyr_{group}.{axis}" for group in ("bias", "scale") for axis in "xyz")

ALONG = EARTH_RATE / 3**0.5
"""Component of the Earth's rate along any axis, rad/s, 1 sigma."""

UNKNOWN = 1e3
"""Prior sigma of parameters, in errors of a mean, so that few spins can be compared."""


def spin_axes(n: int) -> Array:
    """Directions of the table's axis in the device for n spins, (n, 3).

    Each is the best further direction among axes, edges and corners of a cube.

    Raises
    ------
    PlanError
        If n is none.

    """
    if n < 1:
        raise PlanError(f"{n} spins determine nothing: ask for six or more")
    every = [v for v in product((1.0, 0.0, -1.0), repeat=3) if any(v)]
    every.sort(key=lambda v: sum(map(abs, v)))
    directions = np.array(every) / np.linalg.norm(every, axis=1)[:, None]
    rows = np.hstack([directions, directions**2])
    information, chosen = np.eye(6) / UNKNOWN**2, []
    for _ in range(n):
        after = information + np.einsum("ni,nj->nij", rows, rows)
        best = int(np.argmin(np.trace(np.linalg.inv(after), axis1=1, axis2=2).round(9)))
        chosen.append(best)
        information = after[best]
    return np.asarray(directions[chosen])


def expected_by_speed(
    axes: Array, speed: float, speed_sigma: float, sigma: float, rests: int = 0
) -> dict[str, float]:
    """Standard uncertainty of every parameter that the spins determine, (1), (2).

    Parameters
    ----------
    axes : (n, 3) directions of the table's axis in the device, each of length 1
    speed, speed_sigma : rad/s, and how well it is known; one for all spins
    sigma : rad/s, standard error of a gyroscope's mean over one spin or rest
    rests : windows at rest, in any orientation

    Returns
    -------
    by full name, biases in rad/s; what is not determined is absent

    Raises
    ------
    PlanError
        If the table does not turn, or its speed has no ±.

    """
    if not 0 < speed < np.inf:
        raise PlanError("the table must turn: give a speed above 0")
    if not 0 <= speed_sigma < np.inf:
        raise PlanError("how well the speed is known cannot be below 0: give its ±")
    spun = np.hstack([axes, speed * axes**2])  # (1)
    common = np.hypot(speed_sigma, ALONG)
    alike = sigma**2 * np.eye(len(axes)) + common**2
    still = np.tile(np.eye(3, 6), (rests, 1)) / np.hypot(sigma, ALONG)  # (2)
    white = np.vstack([np.linalg.solve(np.linalg.cholesky(alike), spun), still])
    found = zip(NAMES, parameter_sigma(white).tolist(), strict=True)
    return {name: s for name, s in found if np.isfinite(s)}
