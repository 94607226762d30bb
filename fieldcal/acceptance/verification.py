"""Whether the calibration predicts a position that was not fitted.

    r = U - U(x),  S = J C J^T + C_U + (s g)^2 (I - n n^T),  chi2 = r^T S^-1 r

U is the window's mean, (3,) m/s^2 in device axes, U(x) what the calibration x with
covariance C predicts there (`model.planned`), J its derivative, C_U the window's
covariance, s how well the angles are set, n the direction of the force. With 3 degrees
of freedom, chi2 shows whether the known errors explain the residual; its length in
m/s^2 shows whether it matters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.positions import Position, specific_forces
from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import ACC, Array
from fieldcal.model.causes.planned import parameters, predict_outputs
from fieldcal.session.description import Description
from fieldcal.solve.reliability import WrongAngles
from fieldcal.windows import Average

DERIVATIVE_STEP_RAD = 1e-6
"""Of numerical derivatives, rad."""


@dataclass(frozen=True, slots=True)
class Verification:
    """Residual of a position that was not fitted.

    Attributes
    ----------
    position : the position
    residual : (3,) measured less predicted, m/s^2, device axes
    sigma : (3,) standard uncertainty of the residual
    chance : probability of such a residual if the calibration is correct
    covariance : (3, 3) of the residual, S
    parameter_slopes : (3,) derivative of outputs by each parameter, by full name
    angle_slopes : (3, 2) derivative by the position's alpha and beta, m/s^2/rad
    reason : why it could not be measured, if samples are missing

    """

    position: Position
    residual: Array
    sigma: Array
    chance: float
    covariance: Array
    parameter_slopes: Mapping[str, Array]
    angle_slopes: Array
    reason: str = "an axis of the accelerometers gives no value there"

    @classmethod
    def unmeasured(cls, position: Position, reason: str) -> Verification:
        """A position that was held, but whose samples cannot be used."""
        unknown, slopes = np.full(3, np.nan), np.full((3, 2), np.nan)
        return cls(
            position, unknown, unknown, np.nan, np.diag(unknown), {}, slopes, reason
        )

    @property
    def measured(self) -> bool:
        """Whether the residual is known on all axes."""
        return bool(np.isfinite([self.residual_size, self.chance]).all())

    @property
    def residual_size(self) -> float:
        """Length of the residual, m/s^2."""
        return float(np.linalg.norm(self.residual))

    def noncentrality(self, wrong: WrongAngles) -> float:
        """Non-centrality r^T S^-1 r that wrong angles of the session produce here."""
        alpha, beta = self.position.alpha, self.position.beta
        if alpha is None or beta is None or not self.measured:
            return 0.0
        off = wrong.error_at(alpha, beta)
        moved: Array = self.angle_slopes @ off
        for name, by in wrong.moves.items():
            moved = moved - by * self.parameter_slopes.get(name, 0.0)
        return float(moved @ np.linalg.solve(self.covariance, moved))


def verify(
    calibration: Calibration,
    about: Description,
    position: Position,
    average: Average,
    angle_sigma: float = 0.0,
) -> Verification:
    """Compare a window with the prediction of the calibration.

    Parameters
    ----------
    calibration : not fitted to this window
    about : site and mounting
    position : position of the window
    average : average of the window
    angle_sigma : uncertainty of the set angles, rad

    """
    names, x, covariance = _parameters(calibration, about)
    u, j = predict_outputs(names, x, [position], about.gravity, about.mounting)
    residual = average.mean[ACC] - u[0]
    n = about.mounting.T @ specific_forces([position], 1.0)[0]
    setting = (angle_sigma * about.gravity) ** 2 * (np.eye(3) - np.outer(n, n))
    s = j[0] @ covariance @ j[0].T + average.covariance[ACC, ACC] + setting
    chi2 = float(residual @ np.linalg.solve(s, residual))
    chance = chi2_tail(chi2, 3)
    slope = {name: j[0, :, i] for i, name in enumerate(names)}
    turned = np.column_stack([
        (specific_forces([moved], about.gravity)
         - specific_forces([position], about.gravity))[0]
        @ about.mounting / DERIVATIVE_STEP_RAD
        for moved in (
            position.turned(DERIVATIVE_STEP_RAD, 0.0),
            position.turned(0.0, DERIVATIVE_STEP_RAD),
        )
    ])  # fmt: skip
    return Verification(
        position, residual, np.sqrt(np.diag(s)), chance, s, slope, turned
    )


def _parameters(
    calibration: Calibration, about: Description
) -> tuple[tuple[str, ...], Array, Array]:
    """Names, values and covariance of parameters that affect the accelerometers.

    Parameters that were not fitted have their nominal values without uncertainty.
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


def planned_verification(about: Description) -> Position | None:
    """The verification position of session.toml or of a plan; None if there is none."""
    table = about.raw.get("verification")
    if isinstance(table, Mapping) and {"alpha_deg", "beta_deg"} <= set(table):
        name = str(table.get("name", ""))
        return Position.deg(table["alpha_deg"], table["beta_deg"], name)
    run = about.raw.get("run")
    if isinstance(run, Mapping) and run.get("verify") is True:
        return propose_verification(about.positions)
    return None


def propose_verification(positions: Sequence[Position]) -> Position:
    """A position for verification, from the joint angles that the set uses.

    Of all combinations that are not in the set, it is the one farthest from its nearest
    neighbour. If there is none, it is half-way between the first and the last position;
    if all have a third angle, it is home.

    >>> from fieldcal.core.positions import FIVE_POSITIONS
    >>> propose_verification(FIVE_POSITIONS).name
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
    there = specific_forces(positions, 1.0)

    def nearest(pair: tuple[float, float]) -> float:
        f = specific_forces([Position.deg(*pair)], 1.0)[0]
        return round(float(np.linalg.norm(there - f, axis=1).min()), 9)

    return Position.deg(*max(free, key=nearest))


def check_verification(verification: Verification | None, limits: GradeLimits) -> Check:
    """Check the residual of a position that was not fitted, if there is one."""
    if verification is None:
        says = "no verification position was recorded (--verify)"
        return Check("verification", None, says)
    if not verification.measured:
        says = (
            f"{verification.position.name}, which was to verify the result, could not"
            f" be measured ({verification.reason}): record it again"
        )
        return Check("verification", False, says)
    far = verification.residual_size > limits.verification_residual
    odd = verification.chance < limits.verification_chance
    sigma = float(np.linalg.norm(verification.sigma))
    says = (
        f"at {verification.position.name}, which was not fitted, the accelerometers"
        f" differ from the prediction by {verification.residual_size:.2g} ±"
        f" {sigma:.2g} m/s², allowed {limits.verification_residual:.2g} m/s²"
    )
    if odd:
        says += (
            "; the ± of the calibration does not explain this difference (probability"
            f" {verification.chance:.1g})"
        )
    limit = limits.verification_residual
    return Check(
        "verification",
        not (far or odd),
        says,
        verification.residual_size,
        limit,
        "m/s^2",
    )
