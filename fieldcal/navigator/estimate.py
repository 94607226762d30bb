"""Sensor parameters from the drift of a navigation solution at rest.

The solution of run r, at attitude C (device to base), is

    y_r = H (X_phi (phi + phi_r) + X_p p_r + X_e C e + X_a C (a + k f + j_r)) + n   (1)
    n ~ N(0, N_a^2 K_a + N_g^2 K_g + q_v^2 I_v + q_p^2 I_p)                         (2)

with X and K of `growth`. H selects the components of velocity and position that were
recorded. a and e are errors of the biases, k errors of the accelerometers' scale
factors, f = C^T f_base. phi is the attitude error common to all runs: level and azimuth
of the base. phi_r is the error of setting each attitude, p_r the error of the first
position, and j_r an error of the force in each run, of size J. q_v and q_p are
the output noise of velocity and of position. N_a, N_g, q_v, q_p and J maximise the
evidence. The navigator computes with its own calibration; the result U = b
+ s f refers to what it takes for its sensors' outputs. Parameters that a run at rest
hardly shows, such as scale factors of gyroscopes, are not estimated. SI units; base
axes, device axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.frames import specific_force_at_home
from fieldcal.core.samples import Array
from fieldcal.model import priors, thresholds
from fieldcal.navigator.large_angles import beyond_first_order
from fieldcal.navigator.mistakes import ATTITUDES, SCATTER, setups_with_mistakes
from fieldcal.navigator.noise_search import NOISE_LEAST, likeliest_noise
from fieldcal.navigator.run_rows import (
    RunPosterior,
    RunRows,
    RunSetup,
    run_posterior,
    run_rows,
)
from fieldcal.navigator.solution import NavigatorRun

NAMES = tuple(f"{g}.{x}" for g in ("acc_bias", "acc_scale", "gyr_bias") for x in "xyz")
UNITS = ("m/s^2",) * 3 + ("1",) * 3 + ("rad/s",) * 3

PRIOR_SIGMAS = 3.0 * np.concatenate(
    [priors.BIAS[:3], [priors.SCALE] * 3, priors.BIAS[3:]]
)
"""Prior standard deviations: a few times those of consumer grade."""

PASSES = 2
"""Number of times the rows are linearised about the estimate."""

SLOPE_STEPS = np.repeat([1e-7, 1e-4, 1e-4], 3)
"""Steps of rate, force and angle for numerical derivatives."""


@dataclass(frozen=True, slots=True)
class DriftEstimate:
    """Parameters estimated from the drift of a navigation solution.

    Attributes
    ----------
    names, values, covariance : parameters that the runs determine, as in a result
    undetermined : names of the parameters that the runs do not determine
    noise : N_a, N_g, q_v, q_p, J; the least q where it was not recorded
    chi2, dof : chi-square of all rows with that noise, and rows less parameters
    tilt : (3,) rad, phi; `tilt_sigma` its ±
    setup_mistakes : statements about the set-up that the runs contradict, by the names
        of `mistakes`

    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    undetermined: tuple[str, ...]
    noise: tuple[float, float, float, float, float]
    chi2: float
    dof: int
    tilt: Array
    tilt_sigma: Array
    setup_mistakes: tuple[str, ...]

    def calibration(self) -> Calibration:
        """Return the estimate as a calibration."""
        return Calibration(
            "least_squares",
            self.names,
            self.values,
            self.covariance,
            tuple(UNITS[NAMES.index(n)] for n in self.names),
            self.chi2,
            self.dof,
            self.noise[-1],
        )


def estimate_from_drift(runs: Sequence[NavigatorRun], setup: RunSetup) -> DriftEstimate:
    """Estimate the parameters from runs at rest, (1), (2).

    A mistake of the set-up (base not level, wrong azimuth, wrong attitude of a run) is
    accepted if it raises the log evidence by `thresholds.SAME` or more. The runs are
    then solved with it, and the result names it.
    """
    linear = [run_rows(run, setup, r) for r, run in enumerate(runs)]
    best, off = _fit_setup(runs, linear, setup), list[str]()
    while True:
        tried = {
            name: _fit_setup(runs, linear, other, best.noise)
            for name, other in setups_with_mistakes(best.setup)
            if name not in off
            and (
                _may_be_likelier(best, other)
                or (name == ATTITUDES and best.runs_scatter)
            )
        }
        name = max(tried, key=lambda n: tried[n].posterior.score, default="")
        if not name or tried[name].evidence_gain(best) < thresholds.ALIAS_LOG_MARGIN:
            break
        best, off = tried[name], [*off, name]
    return _determined_parameters(
        best, (*off, *([SCATTER] if best.runs_scatter else ()))
    )


@dataclass(frozen=True, slots=True)
class _SetupFit:
    """A set-up with the noise of its greatest evidence, and the parameters."""

    setup: RunSetup
    rows: Sequence[RunRows]
    noise: Array
    posterior: RunPosterior

    @property
    def prior_sigmas(self) -> Array:
        """Prior standard deviations of the parameters and of phi, (12,)."""
        return np.concatenate([PRIOR_SIGMAS, self.setup.base_sigma])

    def evidence_gain(self, other: _SetupFit) -> float:
        """Log evidence, less that of another set-up."""
        return self.posterior.score - other.posterior.score

    @property
    def runs_scatter(self) -> bool:
        """Whether the runs differ by more than noise and errors of attitude explain."""
        calm = run_posterior(
            self.rows, self.prior_sigmas, _without_run_scatter(self.noise)
        ).score
        return self.posterior.score - calm > thresholds.ALIAS_LOG_MARGIN


def _without_run_scatter(noise: Array) -> Array:
    """Noise without the scatter J of the runs, (5,)."""
    return np.append(noise[:-1], NOISE_LEAST[-1])


def _may_be_likelier(best: _SetupFit, other: RunSetup) -> bool:
    """Whether another set-up is more probable at the noise of the best one.

    The noise is tried with and without scatter of the runs, because the scatter
    contains what a mistake leaves unexplained.
    """
    rows, sizes = (
        _with_attitude_sigmas(best.rows, other),
        np.concatenate([PRIOR_SIGMAS, other.base_sigma]),
    )
    each = (best.noise, _without_run_scatter(best.noise))
    score = max(run_posterior(rows, sizes, noise).score for noise in each)
    return score > best.posterior.score


def _with_attitude_sigmas(rows: Sequence[RunRows], setup: RunSetup) -> list[RunRows]:
    """Rows with the attitude uncertainties of a set-up."""
    pairs = zip(rows, setup.attitude_sigmas.tolist(), strict=True)
    return [replace(one, attitude_sigma=sigma) for one, sigma in pairs]


def _fit_setup(
    runs: Sequence[NavigatorRun],
    linear: Sequence[RunRows],
    setup: RunSetup,
    near: Array | None = None,
) -> _SetupFit:
    """Fit noise and parameters of a set-up; `near` is the start value of the noise."""
    linear, sizes = (
        _with_attitude_sigmas(linear, setup),
        np.concatenate([PRIOR_SIGMAS, setup.base_sigma]),
    )
    rows, noise = linear, near
    for _ in range(PASSES):
        noise = likeliest_noise(rows, sizes, noise)
        mean = run_posterior(rows, sizes, noise).mean
        own = [one.attitude_error(noise, mean) for one in rows]
        pairs = zip(linear, runs, strict=True)
        rows = [
            _linearise_about(one, run, setup, r, mean, own[r])
            for r, (one, run) in enumerate(pairs)
        ]
    noise = likeliest_noise(rows, sizes, noise)
    return _SetupFit(setup, rows, noise, run_posterior(rows, sizes, noise))


def _linearise_about(
    one: RunRows, run: NavigatorRun, setup: RunSetup, r: int, mean: Array, own: Array
) -> RunRows:
    """Rows of a run, linearised about errors (12,) and phi_r (3,) instead of zero.

    With a base that leans by a degree, the second order is 1.5 mm/s^2 of gravity.
    """
    c = setup.attitudes[r]
    force = specific_force_at_home(setup.gravity)
    f = c.T @ force
    bias, scale, rate, phi = np.split(mean, 4)
    errors = np.concatenate([rate, bias + scale * f, phi + own])

    def beyond(at: Array) -> Array:
        inputs = (setup.earth, force)
        more = beyond_first_order(run.step, len(run.values), c, inputs, at)
        return np.asarray(more[:, list(setup.recorded)].ravel())

    there = beyond(errors)
    slopes = [(beyond(errors + d) - there) / d.max() for d in np.diag(SLOPE_STEPS)]
    by_rate, by_force, by_phi = np.split(np.column_stack(slopes), 3, axis=1)
    more = np.hstack([by_force, by_force * f, by_rate, by_phi])
    y = one.y - there + more @ mean + by_phi @ own
    return replace(
        one, y=y, design=one.design + more, attitude_design=one.attitude_design + by_phi
    )


def _determined_parameters(best: _SetupFit, off: tuple[str, ...]) -> DriftEstimate:
    """Select the parameters whose variance the runs reduced enough."""
    n, found = len(NAMES), best.posterior
    variance = np.diag(found.covariance)
    known = np.flatnonzero(variance[:n] < thresholds.DETERMINED * PRIOR_SIGMAS**2)
    values = found.mean[:n] + [name.startswith("acc_scale") for name in NAMES]
    force, rate, velocity, position, jitter = map(float, best.noise)
    return DriftEstimate(
        tuple(NAMES[i] for i in known),
        values[known],
        found.covariance[np.ix_(known, known)],
        tuple(name for i, name in enumerate(NAMES) if i not in known),
        (force, rate, velocity, position, jitter),
        found.chi2,
        sum(len(one.y) for one in best.rows) - len(known),
        found.mean[n:],
        np.sqrt(variance[n:]),
        off,
    )
