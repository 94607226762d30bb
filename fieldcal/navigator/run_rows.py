"""Rows of a navigator's runs at rest, and the parameters that they determine.

    y_r = H (X_phi (phi + phi_r) + X_p p_r + X_e C e + X_a C (a + k f + j_r)) + n   (1)
    n ~ N(0, N_a^2 K_a + N_g^2 K_g + q_v^2 I_v + q_p^2 I_p)                         (2)

I_v and I_p have the rows of velocity and position, with the share of the noise that
remains between two samples. With V the covariance of all rows and their parameters,

    d ln Z / d ln N = N^2 (y^T V^-1 K V^-1 y - tr V^-1 K)                           (3)

Symbols and units as in `estimate`. Source of (3): Rasmussen and Williams, Gaussian
Processes for Machine Learning, 2006, (5.9).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.frames import specific_force_at_home
from fieldcal.core.samples import Array
from fieldcal.navigator.growth import PHI, POSITION, error_dynamics, propagate_errors
from fieldcal.navigator.solution import NavigatorRun

START_POSITION_M = 10.0
"""Standard deviation of the first position, m: it is noisy."""


ROUNDING = 1e-12
"""Share of a row's variance that is its own: with runs that scatter by far more than
their outputs are noisy, rounding leaves no positive definite matrix."""


@dataclass(frozen=True, slots=True)
class RunSetup:
    """What is known of the site and of the attitudes of the runs.

    Attributes
    ----------
    earth : (3,) rad/s in base axes
    gravity : m/s^2
    attitudes : (r, 3, 3) C of each run, device to base
    base_sigma : (3,) rad, 1 sigma of phi about each base axis
    attitude_sigmas : (r,) rad, 1 sigma of each phi_r about any axis
    recorded : which of velocity (3) and position (3) was recorded, East, down, north

    """

    earth: Array
    gravity: float
    attitudes: Array
    base_sigma: Array
    attitude_sigmas: Array
    recorded: Sequence[int]


@dataclass(frozen=True, slots=True)
class RunRows:
    """Rows (1) of one run.

    Attributes
    ----------
    y : (n,) errors of the solution
    is_position : (n,) whether a row is of position, m, or of velocity, m/s
    noise_share : (n,) variance of the output noise, of that of a sample
    design : (n, 12) columns of the parameters in the order of `NAMES`, and of phi
    attitude_sigma : rad, standard deviation of phi_r about any axis
    attitude_design : (n, 3) columns of phi_r
    start_covariance : (n, n) covariance of p_r
    jitter : (n, n) covariance of j_r of 1 m/s^2
    rate_noise, force_noise : (n, n) K_g and K_a

    """

    y: Array
    is_position: NDArray[np.bool_]
    noise_share: Array
    design: Array
    attitude_sigma: float
    attitude_design: Array
    start_covariance: Array
    jitter: Array
    rate_noise: Array
    force_noise: Array

    def covariance(self, noise: Array) -> Array:
        """Covariance of the rows for N_a, N_g, q_v, q_p, J, (n, n)."""
        turned = self.attitude_design @ self.attitude_design.T
        whole = self.attitude_sigma**2 * turned + self.start_covariance
        whole += np.tensordot(noise**2, self.noise_parts, 1)
        whole.flat[:: len(whole) + 1] *= 1 + ROUNDING
        return np.asarray(whole)

    @property
    def noise_parts(self) -> Array:
        """Covariance of the rows for 1 of each noise of (2), and of J, (5, n, n)."""
        velocity, position = (
            np.diag(np.where(self.is_position == of_position, self.noise_share, 0.0))
            for of_position in (False, True)
        )
        return np.array(
            [self.force_noise, self.rate_noise, velocity, position, self.jitter]
        )

    def attitude_error(self, noise: Array, mean: Array) -> Array:
        """Estimate phi_r, (3,) rad, if the parameters and phi are `mean`, (12,)."""
        left = np.linalg.solve(self.covariance(noise), self.y - self.design @ mean)
        return np.asarray(self.attitude_sigma**2 * self.attitude_design.T @ left)


def run_rows(run: NavigatorRun, setup: RunSetup, r: int) -> RunRows:
    """Rows of the run numbered r from 0."""
    grown = propagate_errors(
        error_dynamics(setup.earth, setup.gravity), run.step, len(run.values)
    )
    used = np.array(setup.recorded)
    take = (9 * np.arange(len(run.values))[:, None] + 3 + used).ravel()
    start, constant = (
        part.reshape(-1, part.shape[2])[take] for part in (grown.start, grown.constant)
    )
    c = setup.attitudes[r]
    rate, force = constant[:, :3] @ c, constant[:, 3:] @ c
    f = c.T @ specific_force_at_home(setup.gravity)
    is_position = np.tile(used >= len(f), len(run.values))
    began = start[:, POSITION] * (START_POSITION_M if is_position.any() else 0.0)
    pick = np.ix_(take, take)
    return RunRows(
        run.values[:, used].ravel(),
        is_position,
        np.repeat(run.noise_share, len(used)),
        np.hstack([force, force * f, rate, start[:, PHI]]),
        float(setup.attitude_sigmas[r]),
        start[:, PHI],
        began @ began.T,
        force @ force.T,
        grown.rate_noise[pick],
        grown.force_noise[pick],
    )


@dataclass(frozen=True, slots=True)
class RunPosterior:
    """Parameters and phi, (12,), their covariance, ln of the evidence, and chi2."""

    mean: Array
    covariance: Array
    score: float
    chi2: float


def run_posterior(rows: Sequence[RunRows], sizes: Array, noise: Array) -> RunPosterior:
    """Posterior of all runs with prior `sizes` (12,) and `noise`, (5,) as in (2)."""
    g, b, square, log_det = np.zeros((len(sizes),) * 2), np.zeros(len(sizes)), 0.0, 0.0
    for one in rows:
        lower = np.linalg.cholesky(one.covariance(noise))
        white = np.linalg.solve(lower, np.column_stack([one.design, one.y]))
        h, y = white[:, :-1], white[:, -1]
        g, b, square = g + h.T @ h, b + h.T @ y, square + float(y @ y)
        log_det += 2 * float(np.log(np.diagonal(lower)).sum())
    m = np.eye(len(sizes)) + sizes[:, None] * g * sizes
    covariance = sizes[:, None] * np.linalg.inv(m) * sizes
    mean = covariance @ b
    chi2 = square - float(b @ mean)
    score = -0.5 * (chi2 + log_det + float(np.linalg.slogdet(m)[1]))
    return RunPosterior(mean, covariance, score, chi2)


def evidence_slopes(
    rows: Sequence[RunRows], found: RunPosterior, noise: Array
) -> Array:
    """Slopes of ln Z by the logarithm of each noise, (5,), at its posterior, (3)."""
    out = np.zeros(len(noise))
    for one in rows:
        inverse = np.linalg.inv(one.covariance(noise))
        seen = inverse @ one.design
        left = inverse @ (one.y - one.design @ found.mean)  # V^-1 y
        own = inverse - seen @ found.covariance @ seen.T  # V^-1
        out += np.tensordot(one.noise_parts, np.outer(left, left) - own, 2)
    return np.asarray(noise**2 * out)  # (3)
