"""Design matrices: how each block of parameters reaches the accelerometers' means.

    U = b + (diag(k) + K) f,  K = [[0, k12, k13], [k21, 0, k23], [k31, k32, 0]]   (6)

with f as `tilt` has it for each model of the tilt. U, b m/s^2 and k, K in device axes.
Source: Avrutov and Pozniak 2023, with the sign of (5) corrected.

Every function takes arrays with any leading dimensions, so that many parameter vectors
are evaluated at once; the planner calls them before anything is measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.frames import force_home
from fieldcal.positions import Position
from fieldcal.samples import Array
from fieldcal.solve import linear
from fieldcal.solve.estimate import OFF_DIAGONAL, axes
from fieldcal.solve.observations import Observations
from fieldcal.solve.tilt import RAD, TILT_NAMES, Tilt, tilted

LADDER = tuple(
    Position.deg(a, b)
    for a, b in [(45, 5), (-45, 5), (45, -5), (45, 0), (0, 5), (22.5, 2.5), (90, 0),
                 (0, 90), (180, 0), (45, 45)]
)  # fmt: skip
"""Positions that can be proposed: first within a small ladder, then beyond it."""


@dataclass(frozen=True, slots=True)
class Model:
    """Which parameters the accelerometers' means are explained with.

    Attributes
    ----------
    tilt : how the base may be tilted
    cross : whether cross-coupling is estimated

    """

    tilt: Tilt = "none"
    cross: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Full names of the p parameters, in the order of every design here."""
        cross = [f"cross_coupling.k{ij}" for ij in OFF_DIAGONAL] if self.cross else []
        return (
            *axes("acc_bias"),
            *axes("acc_scale"),
            *cross,
            *TILT_NAMES[self.tilt],
        )

    @property
    def start(self) -> Array:
        """Parameters of a perfect device on a level base, (p,)."""
        x = np.zeros(len(self.names))
        x[3:6] = 1.0
        return x


def coupling(model: Model, x: Array) -> Array:
    """Matrix diag(k) + K of parameters (..., p), (..., 3, 3)."""
    m = np.zeros((*x.shape[:-1], 3, 3))
    m[..., range(3), range(3)] = x[..., 3:6]
    if model.cross:
        for column, ij in enumerate(OFF_DIAGONAL):
            m[..., int(ij[0]) - 1, int(ij[1]) - 1] = x[..., 6 + column]
    return m


def predict(
    model: Model,
    positions: Sequence[Position],
    gravity: float,
    mounting: Array,
    x: Array,
) -> tuple[Array, Array]:
    """Means that parameters predict, and the design.

    Parameters
    ----------
    x : (..., p) in the order of ``model.names``
    model, positions, mounting : as in `tilted`
    gravity : m/s^2

    Returns
    -------
    u : (..., n, 3) m/s^2
    design : (..., n, 3, p) derivatives of u

    """
    linear_count = 12 if model.cross else 6
    home, degrees = force_home(gravity), x[..., linear_count:]
    f, by_tilt = tilted(model.tilt, positions, home, mounting, degrees)
    m = coupling(model, x)
    u = x[..., None, :3] + f @ np.swapaxes(m, -1, -2)  # (6)
    design = np.zeros((*f.shape, x.shape[-1]))
    for axis in range(3):
        design[..., axis, axis] = 1.0
        design[..., axis, 3 + axis] = f[..., axis]
    if model.cross:
        for column, ij in enumerate(OFF_DIAGONAL):
            design[..., int(ij[0]) - 1, 6 + column] = f[..., int(ij[1]) - 1]
    design[..., linear_count:] = m[..., None, :, :] @ by_tilt
    return u, design


def design(
    model: Model,
    positions: Sequence[Position],
    gravity: float,
    mounting: Array | None = None,
    x: Array | None = None,
) -> Array:
    """Design matrix of planned positions, (n, 3, p), about `x` or a perfect device."""
    p = np.eye(3) if mounting is None else mounting
    return predict(
        model, positions, gravity, p, model.start if x is None else x
    )[1]  # fmt: skip


def loosely_set(observations: Observations, sigma_deg: float) -> Observations:
    """Observations of a device that stands a little off its angles in each position.

    The error is independent from position to position and alike about every level
    axis; it is added to the accelerometers' covariance. Positions without known angles
    stay as they are.
    """
    known = np.flatnonzero(observations.oriented)
    up = observations.forces[known]
    level = observations.gravity**2 * np.eye(3) - up[:, :, None] * up[:, None, :]
    scale = np.array(observations.nominal.acc_scale)
    covariance = observations.covariance.copy()
    covariance[known, :3, :3] += (sigma_deg * RAD) ** 2 * np.outer(scale, scale) * level
    return replace(observations, covariance=covariance)


def ladder_remedy(
    observations: Observations, wanted: linear.Mask, model: Model | None = None
) -> list[str]:
    """Names of the fewest positions of `LADDER` that would determine `wanted`, (p,)."""
    model = model or Model()

    def rows(places: Sequence[Position]) -> Array:
        return design(model, places, observations.gravity, observations.mounting)

    extra = linear.remedy(rows, observations.positions, LADDER, wanted)
    return [p.name for p in extra]
