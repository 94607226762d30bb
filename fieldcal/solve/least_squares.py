"""Least squares over n known positions or n known rates of a table.

    axial accelerometers      U = B + M1 f                                        (1.1)
    pendulous accelerometers  U = B + M1 f + M2 (fx fy, fy fz, fx fz)             (2.1)
    gyroscopes                W = B + M1 w                                        (3.1)
    gyroscopes, expanded      W = B + M1 w + M2 (wx wy, wy wz, wx wz)             (4.1)

One row of the matrix G is (1, v) or (1, v, products), v = f or w, and the printed
solution X = (G^T G)^-1 G^T U (1.3) (2.3) (3.3) (4.3) is computed from singular values
instead, weighted by the windows' covariances. f in m/s^2, w in rad/s, B and M in device
axes. The diagonal of M1 is the scale factor, the rest cross-coupling. The Earth's rate
is taken out of W as far as it is known, and part of its error otherwise (`earth`).
Source: Avrutov, Sapegin, Stefanishin, Tsisarzh 2017.

Rank and conditioning decide before any number is given: what the schedule does not
determine is named and left out, the rest is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.errors import NotObservable
from fieldcal.positions import Position, forces, rates
from fieldcal.samples import Array
from fieldcal.solve import linear, scatter
from fieldcal.solve.design import LADDER
from fieldcal.solve.earth import earth_rate
from fieldcal.solve.estimate import NO_DOF, Estimate, not_determined
from fieldcal.solve.observations import ACC, GYR, Observations
from fieldcal.solve.tilt import LEVEL, Base

POORLY = 1e4
"""Condition number from which the answer is said to be sensitive."""

Rows = Callable[[Sequence[Position]], Array]


@dataclass(frozen=True, slots=True)
class Sensor:
    """What the least squares of one kind of sensor are called.

    Attributes
    ----------
    channels : its columns of the means
    bias, scale, cross, products : groups of the parameters
    cross_letter, product_letter : letters of their components
    candidates : places that can be proposed where something is not determined

    """

    channels: slice
    bias: str
    scale: str
    cross: str
    products: str
    cross_letter: str
    product_letter: str
    candidates: tuple[Position, ...]

    def names(self, columns: int) -> list[list[str]]:
        """Full names, one row a column of G, one column a channel."""
        table = [[f"{self.bias}.{axis}" for axis in "xyz"]]
        for j in range(3):
            table.append(
                [
                    f"{self.scale}.{'xyz'[i]}"
                    if i == j
                    else f"{self.cross}.{self.cross_letter}{i + 1}{j + 1}"
                    for i in range(3)
                ]  # fmt: skip
            )
        for j in range(columns - 4):
            product = f"{self.products}.{self.product_letter}"
            table.append([f"{product}{i + 1}{j + 1}" for i in range(3)])
        return table


def _rate(x: float, y: float, z: float) -> Position:
    rate = np.deg2rad([x, y, z])
    return Position(f"a rate of ({x:g}, {y:g}, {z:g})°/s", rate=tuple(rate.tolist()))


ACCELEROMETERS = Sensor(
    ACC, "acc_bias", "acc_scale", "cross_coupling", "pendulous_products", "k", "l",
    LADDER,
)  # fmt: skip
GYROSCOPES = Sensor(
    GYR, "gyr_bias", "gyr_scale", "gyro_cross_coupling", "gyro_products", "s", "p",
    tuple(
        _rate(*(20.0 * sign * np.array(axis)).tolist())
        for axis in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1)]
        for sign in (1, -1)
    ),
)  # fmt: skip


def matrix(v: Array, products: bool = False) -> Array:
    """Rows (1, v) or (1, v, products) of the calibration equation, (n, 4) or (n, 7).

    >>> matrix(np.array([[1.0, 2.0, 3.0]]), products=True)
    array([[1., 1., 2., 3., 2., 6., 3.]])
    """
    parts = [np.ones((len(v), 1)), v]
    if products:
        parts.append(v * np.roll(v, -1, axis=1))  # x y, y z, z x
    return np.hstack(parts)


def accelerometers(observations: Observations, products: bool = False) -> Estimate:
    """Bias, scale factor, cross-coupling, (1.3); with `products` pendulous, (2.3).

    Parameters
    ----------
    observations : n positions at rest with known angles
    products : estimate the coefficients of the products of two axes as well

    Raises
    ------
    NotObservable
        If the angles of a position are not known, or nothing is determined.

    """
    if not observations.oriented.all() or observations.rotating.any():
        raise NotObservable(
            "least squares needs positions at rest with known angles: the scalar "
            "method does without angles"
        )

    def rows(places: Sequence[Position]) -> Array:
        f = forces(places, observations.gravity) @ observations.mounting
        return matrix(f, products)

    return scatter.absorb(
        lambda seen: _solve(rows, seen, ACCELEROMETERS), observations, ACC, "positions"
    )


def gyroscopes(
    observations: Observations,
    products: bool = False,
    heading_sigma: float | None = None,
    base: Base = LEVEL,
    as_printed: bool = False,
) -> Estimate:
    """Bias, scale factor, cross-coupling, (3.3); with `products` expanded, (4.3).

    Parameters
    ----------
    observations : n known rates; a position without one counts as at rest
    products : estimate the coefficients of the products of two axes as well
    heading_sigma : how well z points north, rad; None where it points anywhere
    base : how it is tilted
    as_printed : leave the Earth's rate in the bias

    Raises
    ------
    NotObservable
        If nothing is determined.

    """

    def rows(places: Sequence[Position]) -> Array:
        return matrix(rates(places) @ observations.mounting, products)

    mean, beside = observations.mean.copy(), None
    if not as_printed:
        known, beside = earth_rate(observations, heading_sigma, base)
        mean[:, GYR] -= known
    return scatter.absorb(
        lambda seen: _solve(rows, seen, GYROSCOPES, beside),
        replace(observations, mean=mean),
        GYR,
        "rates",
    )


def _solve(
    rows: Rows,
    observations: Observations,
    sensor: Sensor,
    beside: Array | None = None,
) -> Estimate:
    """Solve the three channels together, each with the columns of G.

    `beside` (n, 3, k) are columns of unknown factors of mean 0 and variance 1.
    """
    g = rows(observations.positions)
    n, columns = g.shape
    y = observations.mean[:, sensor.channels]
    noise = observations.covariance[:, sensor.channels, sensor.channels]
    # unknowns in the order of G's columns, then the channel
    design = np.einsum("nk,cd->nckd", g, np.eye(3)).reshape(n, 3, 3 * columns)
    unknown = np.zeros((n, 3, 0)) if beside is None else beside
    fit = linear.fit_beside(design, y, noise, unknown)
    table = sensor.names(columns)
    names = tuple(name for row in table for name in row)
    if not fit.determined.any():
        raise NotObservable(_missing(rows, observations, sensor, fit, table))
    warnings = []
    if not fit.determined.all():
        warnings.append(_missing(rows, observations, sensor, fit, table))
    if fit.condition > POORLY:
        warnings.append(
            f"the schedule determines its parameters poorly (condition number "
            f"{fit.condition:.1e}): small errors of the angles or rates show enlarged"
        )
    if fit.dof == 0:
        warnings.append(NO_DOF)
    whole = Estimate(
        names, fit.values, fit.covariance, fit.chi2, fit.dof,
        float(np.sqrt(np.mean(fit.residual**2))), fit.gain.reshape(-1, n, 3),
        tuple(warnings),
    )  # fmt: skip
    return _ordered(whole.only(fit.determined), sensor)


def _missing(
    rows: Rows,
    observations: Observations,
    sensor: Sensor,
    fit: linear.LinearFit,
    table: list[list[str]],
) -> str:
    """Say what the schedule leaves open, and the places that would fix it."""
    names = [n for row in table for n in row]
    missing = [n for n, d in zip(names, fit.determined, strict=True) if not d]
    extra = linear.remedy(
        lambda places: rows(places)[:, None, :],
        observations.positions,
        sensor.candidates,
        np.ones(len(table), dtype=bool),
    )
    return not_determined(missing, [p.name for p in extra], "this schedule")


def _ordered(estimate: Estimate, sensor: Sensor) -> Estimate:
    """Sort by group, then by component."""
    groups = [sensor.bias, sensor.scale, sensor.cross, sensor.products]
    order = sorted(
        range(len(estimate.names)),
        key=lambda i: (
            groups.index(estimate.names[i].partition(".")[0]), estimate.names[i]
        ),
    )  # fmt: skip
    return estimate.at(order)
