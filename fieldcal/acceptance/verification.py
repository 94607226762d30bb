"""Whether the calibration predicts a position that was not fitted.

    r = U - U(x),  S = J C J^T + C_U + (s g)^2 (I - n n^T),  chi2 = r^T S^-1 r

U is the window's mean, (3,) m/s^2 in device axes, U(x) what the calibration x with
covariance C predicts there (`model.planned`), J its derivative, C_U the window's
covariance, s how well the angles are set, n the direction of the force. With 3 degrees
of freedom, chi2 tells a residual from what everything known explains; its length in
m/s^2 tells whether it matters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.chances import chi2_tail
from fieldcal.core.positions import Position, forces
from fieldcal.core.samples import ACC, Array
from fieldcal.model.causes.planned import parameters, predicted
from fieldcal.session.description import Description
from fieldcal.solve.reliability import WrongAngles
from fieldcal.windows import Average

STEP = 1e-6
"""Of numerical derivatives, rad."""


@dataclass(frozen=True, slots=True)
class Verification:
    """Residual of a position that was not fitted.

    Attributes
    ----------
    position : where
    residual : (3,) measured less predicted, m/s^2, device axes
    sigma : (3,) standard uncertainty of that
    chance : probability of such a residual if the calibration holds
    covariance : (3, 3) of the residual, S
    slope : (3,) m/s^2 by each parameter, full name
    turned : (3, 2) m/s^2 by the position's alpha and beta, rad

    """

    position: Position
    residual: Array
    sigma: Array
    chance: float
    covariance: Array
    slope: Mapping[str, Array]
    turned: Array

    @property
    def largest(self) -> float:
        """Length of the residual, m/s^2."""
        return float(np.linalg.norm(self.residual))

    def shows(self, wrong: WrongAngles) -> float:
        """Non-centrality by which wrong angles of the session show here, r^T S^-1 r."""
        if self.position.alpha is None or self.position.beta is None:
            return 0.0
        off = wrong.error_at(self.position.alpha, self.position.beta)
        moved: Array = self.turned @ off
        for name, by in wrong.moves.items():
            moved = moved - by * self.slope.get(name, 0.0)
        return float(moved @ np.linalg.solve(self.covariance, moved))


def verify(
    calibration: Calibration,
    about: Description,
    position: Position,
    average: Average,
    angle_sigma: float = 0.0,
) -> Verification:
    """Compare a window with what the calibration predicts.

    Parameters
    ----------
    calibration : not fitted to this window
    about : site and mounting
    position : where it was held
    average : of the window
    angle_sigma : how well its angles are set, rad

    """
    names, x, covariance = _parameters(calibration, about)
    u, j = predicted(names, x, [position], about.gravity, about.mounting)
    residual = average.mean[ACC] - u[0]
    n = about.mounting.T @ forces([position], 1.0)[0]
    setting = (angle_sigma * about.gravity) ** 2 * (np.eye(3) - np.outer(n, n))
    s = j[0] @ covariance @ j[0].T + average.covariance[ACC, ACC] + setting
    chi2 = float(residual @ np.linalg.solve(s, residual))
    chance = chi2_tail(chi2, 3)
    slope = {name: j[0, :, i] for i, name in enumerate(names)}
    turned = np.column_stack([
        (forces([moved], about.gravity) - forces([position], about.gravity))[0]
        @ about.mounting / STEP
        for moved in (_turned(position, STEP, 0.0), _turned(position, 0.0, STEP))
    ])  # fmt: skip
    return Verification(
        position, residual, np.sqrt(np.diag(s)), chance, s, slope, turned
    )


def _turned(position: Position, alpha: float, beta: float) -> Position:
    """A position with other angles, rad more."""
    return replace(
        position,
        alpha=(position.alpha or 0.0) + alpha,
        beta=(position.beta or 0.0) + beta,
    )


def _parameters(
    calibration: Calibration, about: Description
) -> tuple[tuple[str, ...], Array, Array]:
    """Names, values and covariance of what reaches the accelerometers.

    Exact where it was not fitted.
    """
    reach = ("angle_offset", "base_tilt", "cross_coupling")
    names = parameters(*(g for g in reach if g in calibration.groups))
    nominal = np.concatenate([about.nominal["acc_bias"], about.nominal["acc_scale"]])
    x = np.zeros(len(names))
    x[:6] = nominal
    covariance = np.zeros((len(x), len(x)))
    known = [i for i, name in enumerate(names) if name in calibration.names]
    rows = [calibration.names.index(names[i]) for i in known]
    x[known] = calibration.values[rows]
    covariance[np.ix_(known, known)] = calibration.covariance[np.ix_(rows, rows)]
    return names, x, covariance


def planned(about: Description) -> Position | None:
    """The position that session.toml or a plan wants held and not fitted, if any."""
    table = about.raw.get("verification")
    if isinstance(table, Mapping) and {"alpha_deg", "beta_deg"} <= set(table):
        name = str(table.get("name", ""))
        return Position.deg(table["alpha_deg"], table["beta_deg"], name)
    run = about.raw.get("run")
    if isinstance(run, Mapping) and run.get("verify") is True:
        return proposed(about.positions)
    return None


def proposed(positions: Sequence[Position]) -> Position:
    """A position to verify with, from the joint angles that the set uses anyway.

    Of all combinations that are not in the set, the one farthest from its nearest
    neighbour; if there is none, the first position turned back half-way to the last,
    and home if all have a third angle.

    >>> from fieldcal.core.positions import FIVE
    >>> proposed(FIVE).name
    'α = 0°, β = 5°'
    """
    known = [p.degrees for p in positions if p.degrees is not None]
    if not known:
        return Position.deg(0.0, 0.0)
    grid = product({a for a, _ in known}, {b for _, b in known})
    free = sorted(pair for pair in grid if pair not in known)
    if not free:
        a, b = np.mean([known[0], known[-1]], axis=0)
        return Position.deg(float(a), float(b))
    there = forces(positions, 1.0)

    def nearest(pair: tuple[float, float]) -> float:
        f = forces([Position.deg(*pair)], 1.0)[0]
        return round(float(np.linalg.norm(there - f, axis=1).min()), 9)

    return Position.deg(*max(free, key=nearest))
