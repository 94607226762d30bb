"""Fit of the gyroscopes to turns between known directions.

With W the output, b the bias and S the matrix of scale factors and couplings, in the
axes of the calibrated accelerometers, u the unit vector along the specific force,

    w = S^-1 (W - b),   u_after = F(w) u_before,   F from `rotation`
    r = [a1 a2]^T (F u_before - u_after),   a1, a2 level at u_after
    dr = [a1 a2]^T (u_after x s),   s = -sum_k B_k S^-1 (dS w_k + db) h

and S, b follow from all turns by weighted Gauss-Newton. Each turn has two equations: a
turn about the vertical does not show. The covariance of r holds the directions (shared
by neighbouring turns), the calibration of the accelerometers (shared by all), the noise
of the integral, a bias that wanders from rest to rest, and the Earth's rate of unknown
heading. The bias comes from the rests. Every entry of S starts from its nominal value
known to `PRIOR`; one that the turns do not improve to `USEFUL` is not for use, but what
it may be is in the uncertainty of the others. Source: Tedaldi, Pretto, Menegatti 2014,
for the principle; the covariance is worked out here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.samples import Array
from fieldcal.solve import linear
from fieldcal.solve.estimate import OFF_DIAGONAL, Estimate, axes
from fieldcal.solve.rotation import Turn, cross_matrix, integrate

PRIOR = 0.05
"""What a scale factor or coupling may deviate from the nominal one by, before."""

USEFUL = 0.01
"""Least certainty for an entry to be reported."""

STEPS = 10
SMALL = 1e-9

NAMES = (
    *axes("gyr_bias"),
    *axes("gyr_scale"),
    *(f"gyro_cross_coupling.s{ij}" for ij in OFF_DIAGONAL),
)
ENTRIES = (
    *((i, i) for i in range(3)),
    *((int(ij[0]) - 1, int(ij[1]) - 1) for ij in OFF_DIAGONAL),
)
"""Places in S of the parameters after the bias."""


@dataclass(frozen=True, slots=True)
class Rests:
    """The directions before and after the turns, and how they are known.

    Attributes
    ----------
    up : (n, 3) unit vector along the specific force of each rest
    by_mean : (n, 3, 3) derivative of `up` by the accelerometers' means
    by_calibration : (n, 3, q) derivative by the accelerometers' parameters
    mean_covariance : (n, 3, 3)
    calibration_covariance : (q, q)

    """

    up: Array
    by_mean: Array
    by_calibration: Array
    mean_covariance: Array
    calibration_covariance: Array


@dataclass(frozen=True, slots=True)
class Drive:
    """What is known of the gyroscopes before the turns are looked at.

    Attributes
    ----------
    bias, bias_covariance : from the rests
    scale : (3,) nominal
    density : (3, 3) noise of a mean times its length, (rad/s)^2 s
    wander : standard deviation of the bias from rest to rest, rad/s

    """

    bias: Array
    bias_covariance: Array
    scale: Array
    density: Array
    wander: float


@dataclass(frozen=True, slots=True)
class Problem:
    """All turns together.

    Attributes
    ----------
    rests : n rests
    drive : the gyroscopes
    before : (m,) number of the rest before each turn; the next one is after it
    spans : m turns, instants (k,) s and outputs (k, 3) rad/s

    """

    rests: Rests
    drive: Drive
    before: NDArray[np.integer[Any]]
    spans: Sequence[tuple[Array, Array]]

    def solve(self, spread: float) -> Estimate:
        """Fit, with a further scatter of the directions, rad."""
        x = np.concatenate([self.drive.bias, self.drive.scale, np.zeros(6)])
        start = x.copy()
        known = np.zeros((12, 12))
        known[:3, :3] = linear.whitener(self.drive.bias_covariance)
        known[3:, 3:] = np.eye(9) / PRIOR
        for _ in range(STEPS):
            r, rows, noise = self._linearised(x, spread)
            white = linear.whitener(noise)
            a = np.vstack([white @ rows, known])
            b = np.concatenate([white @ r, known @ (x - start)])
            step = np.linalg.lstsq(a, -b)[0]
            x = x + step
            if np.abs(step).max() < SMALL:
                break
        covariance = np.linalg.inv(a.T @ a)
        # the prior of S is no measurement: it counts only as far as it was needed
        lent = float(np.diag(covariance)[3:].sum()) / PRIOR**2
        chi2 = float((b[: len(r) + 3] ** 2).sum())
        dof = max(0, round(len(r) + 3 - 12 + lent))
        rms = float(np.sqrt(np.mean(r**2)))
        return Estimate(NAMES, x, covariance, chi2, dof, rms)

    def _linearised(self, x: Array, spread: float) -> tuple[Array, Array, Array]:
        """Residuals (2 m,), their derivatives (2 m, 12) and covariance."""
        matrix = np.zeros((3, 3))
        for value, place in zip(x[3:], ENTRIES, strict=True):
            matrix[place] = value
        inverse = np.linalg.inv(matrix)
        m, n = len(self.spans), len(self.rests.up)
        r, rows = np.zeros((m, 2)), np.zeros((m, 2, 12))
        by_up, own = np.zeros((m, 2, n, 3)), np.zeros((m, 2, m, 2))
        for i, (t, output) in enumerate(self.spans):
            turn = integrate(t, (output - x[:3]) @ inverse.T)
            first = self.before[i]
            reached = turn.whole @ self.rests.up[first]
            level = level_axes(self.rests.up[first + 1])
            r[i] = level @ (reached - self.rests.up[first + 1])
            by_up[i, :, first] = level @ turn.whole
            by_up[i, :, first + 1] = -level
            sees = level @ cross_matrix(reached)
            rows[i] = sees @ _by_parameter(turn, inverse)
            own[i, :, i] = sees @ self._noise(turn, inverse) @ sees.T
        noise = self._covariance(by_up.reshape(2 * m, n, 3), spread)
        return r.ravel(), rows.reshape(-1, 12), noise + own.reshape(2 * m, 2 * m)

    def _noise(self, turn: Turn, inverse: Array) -> Array:
        """Covariance of the small rotation that the gyroscopes' noise makes, (3, 3)."""
        b = turn.later @ inverse
        h = turn.step[:, None, None]
        white = (h * b @ self.drive.density @ np.swapaxes(b, -1, -2)).sum(axis=0)
        whole = (h * b).sum(axis=0)
        return np.asarray(white + self.drive.wander**2 * whole @ whole.T)

    def _covariance(self, by_up: Array, spread: float) -> Array:
        """Covariance that the directions make, (2 m, 2 m)."""
        rests = self.rests
        by_mean = np.einsum("rni,nij->rnj", by_up, rests.by_mean)
        noise = np.einsum(
            "rni,nij,snj->rs", by_mean, rests.mean_covariance, by_mean, optimize=True
        )
        shared = np.einsum("rni,niq->rq", by_up, rests.by_calibration)
        flat = by_up.reshape(len(by_up), -1)
        return np.asarray(
            noise
            + shared @ rests.calibration_covariance @ shared.T
            + spread**2 * flat @ flat.T
        )


def _by_parameter(turn: Turn, inverse: Array) -> Array:
    """Small rotation s by bias and entries of S, (3, 12)."""
    whole = np.einsum("kij,k->ij", turn.later, turn.step) @ inverse
    by_entry = np.einsum(
        "kij,jc,kd,k->icd", turn.later, inverse, turn.rate, turn.step, optimize=True
    )
    entries = [by_entry[:, row, column] for row, column in ENTRIES]
    return -np.column_stack([whole, *entries])


def level_axes(up: Array) -> Array:
    """Two unit vectors at right angles to `up` and to each other, (2, 3)."""
    return np.asarray(np.linalg.svd(up[None])[2][1:])
