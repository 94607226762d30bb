"""Sensors' parameters from how a navigator drifted at rest.

Of run r, at attitude C (device to base) and with attitude error phi_0,

    y_r = H (X_phi (phi + phi_r) + X_p p_r + X_e C e + X_a C (a + k f + j_r)) + n   (1)
    n ~ N(0, N_a^2 K_a + N_g^2 K_g + q^2 I)                                         (2)

with X and K of `growth`, H what of velocity and position was recorded, a and e the
errors of the biases, k those of the accelerometers' scale factors, f = C^T f_base. phi
is what all runs are off by alike: how level the base is, how well its azimuth is known;
phi_r how well each attitude is set; p_r where a position began; j_r what a run's forces
are off by for themselves, of size J. N_a, N_g, q and J are those of the greatest
evidence. The navigator computed with its own calibration in use: what is found is U = b
+ s f of what it takes for its sensors' outputs. What a run at rest hardly shows, such
as scale factors of gyroscopes, is not estimated. SI units; base axes, device axes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.frames import force_home
from fieldcal.core.samples import Array
from fieldcal.model import priors, thresholds
from fieldcal.navigator.growth import PHI, PLACE, growth, matrix
from fieldcal.navigator.large_angles import beyond_first_order
from fieldcal.navigator.solution import Run

NAMES = tuple(f"{g}.{x}" for g in ("acc_bias", "acc_scale", "gyr_bias") for x in "xyz")
UNITS = ("m/s^2",) * 3 + ("1",) * 3 + ("rad/s",) * 3

SIZES = 3.0 * np.repeat([priors.BIAS_ACC, priors.SCALE, priors.BIAS_GYR], 3)
"""Before anything is seen: a few times what consumer grade reaches."""

BEGAN_M = 10.0
"""How far from where it is a navigator may begin, m: the first position is noisy."""

NEAR = {"fatol": 0.02, "xatol": 0.03}
"""Where the search for N_a, N_g, q and J ends: ln of the evidence, and of each."""

PASSES = 2
"""How often what is not linear in the parameters is taken off."""

LEAST = (1e-6, 1e-8, 1e-6, 1e-6)
MOST = (0.1, 1e-2, 10.0, 0.3)
"""N_a in m/s^2/sqrt(Hz), N_g in rad/s/sqrt(Hz), q in m/s and m, J in m/s^2."""


@dataclass(frozen=True, slots=True)
class Setup:
    """What is known of the place and the runs.

    Attributes
    ----------
    earth : (3,) rad/s in base axes
    gravity : m/s^2
    attitudes : (r, 3, 3) C of each run, device to base
    common : (3,) rad, 1 sigma of phi about each base axis
    own : (r,) rad, 1 sigma of each phi_r about any axis
    used : which of velocity (3) and position (3) was recorded, East, down, north

    """

    earth: Array
    gravity: float
    attitudes: Array
    common: Array
    own: Array
    used: Sequence[int]


@dataclass(frozen=True, slots=True)
class Drift:
    """What was found.

    Attributes
    ----------
    names, values, covariance : parameters that the runs determine, as results have them
    missing : those that they do not
    noise : N_a, N_g, q, J
    chi2, dof : of all rows with that noise, and rows less parameters
    tilt : (3,) rad, phi; `tilt_sigma` its ±

    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    missing: tuple[str, ...]
    noise: tuple[float, float, float, float]
    chi2: float
    dof: int
    tilt: Array
    tilt_sigma: Array

    def calibration(self) -> Calibration:
        """As every estimate of this program."""
        return Calibration(
            "least_squares",
            self.names,
            self.values,
            self.covariance,
            tuple(UNITS[NAMES.index(n)] for n in self.names),
            self.chi2,
            self.dof,
            self.noise[3],
        )


def estimate(runs: Sequence[Run], setup: Setup) -> Drift:
    """Estimate the parameters from runs at rest, (1), (2)."""
    linear = [_rows(run, setup, r) for r, run in enumerate(runs)]
    sizes = np.concatenate([SIZES, setup.common])
    rows, noise = linear, None
    for _ in range(PASSES):
        noise = _likeliest(rows, sizes, noise)
        found = _posterior(rows, sizes, noise)
        pairs = zip(linear, runs, strict=True)
        rows = [
            one.less(_beyond(run, setup, r, found.mean))
            for r, (one, run) in enumerate(pairs)
        ]
    noise = _likeliest(rows, sizes, noise)
    return _drift(_posterior(rows, sizes, noise), noise, sum(len(r.y) for r in rows))


def _likeliest(rows: Sequence[RunRows], sizes: Array, near: Array | None) -> Array:
    """N_a, N_g, q, J of the greatest evidence, (4,); sought near some if given."""
    from scipy.optimize import minimize

    least, most = np.log(LEAST), np.log(MOST)

    def worse(logs: Array) -> float:
        inside = np.clip(logs, least, most)
        beyond = float(np.sum((logs - inside) ** 2))
        return 100.0 * beyond - _posterior(rows, sizes, np.exp(inside)).score

    start = _coarsely(worse, least, most) if near is None else np.log(near)
    found = minimize(worse, start, method="Nelder-Mead", options=NEAR)
    return np.asarray(np.exp(np.clip(found.x, least, most)))


def _beyond(run: Run, setup: Setup, r: int, mean: Array) -> Array:
    """What errors (12,) do to a run beyond the first order, (n,)."""
    c, force = setup.attitudes[r], force_home(setup.gravity)
    bias, scale, rate, phi = np.split(mean, 4)
    errors = np.concatenate([rate, bias + scale * (c.T @ force), phi])
    more = beyond_first_order(
        run.step, len(run.values), c, (setup.earth, force), errors
    )
    return np.asarray(more[:, list(setup.used)].ravel())


def _coarsely(worse: Callable[[Array], float], least: Array, most: Array) -> Array:
    """Where a coarse grid of the logarithms is best."""
    parts = [np.linspace(a, b, 5)[1:-1] for a, b in zip(least, most, strict=True)]
    points = np.stack(np.meshgrid(*parts), axis=-1).reshape(-1, len(least))
    return np.asarray(points[int(np.argmin([worse(p) for p in points]))])


@dataclass(frozen=True, slots=True)
class RunRows:
    """Rows (1) of one run.

    Attributes
    ----------
    y : (n,) what the solution is off by
    design : (n, 12) of the parameters in the order of `NAMES`, and of phi
    own : (n, n) covariance of phi_r and p_r
    jitter : (n, n) of j_r of 1 m/s^2
    rate_noise, force_noise : (n, n) K_g and K_a

    """

    y: Array
    design: Array
    own: Array
    jitter: Array
    rate_noise: Array
    force_noise: Array

    def less(self, more: Array) -> RunRows:
        """The rows less what is not in the columns, (n,)."""
        return replace(self, y=self.y - more)

    def covariance(self, noise: Array) -> Array:
        """R of the rows by N_a, N_g, q, J, (n, n)."""
        force, rate, out, jitter = noise**2
        whole = self.own + jitter * self.jitter + out * np.eye(len(self.y))
        return np.asarray(whole + force * self.force_noise + rate * self.rate_noise)


def _rows(run: Run, setup: Setup, r: int) -> RunRows:
    grown = growth(matrix(setup.earth, setup.gravity), run.step, len(run.values))
    used = np.array(setup.used)
    take = (9 * np.arange(len(run.values))[:, None] + 3 + used).ravel()
    start, constant = (
        part.reshape(-1, part.shape[2])[take] for part in (grown.start, grown.constant)
    )
    c = setup.attitudes[r]
    rate, force = constant[:, :3] @ c, constant[:, 3:] @ c
    f = c.T @ force_home(setup.gravity)
    turned = start[:, PHI] * setup.own[r]
    began = start[:, PLACE] * (BEGAN_M if used.max() >= len(f) else 0.0)
    pick = np.ix_(take, take)
    return RunRows(
        run.values[:, used].ravel(),
        np.hstack([force, force * f, rate, start[:, PHI]]),
        turned @ turned.T + began @ began.T,
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


def _posterior(rows: Sequence[RunRows], sizes: Array, noise: Array) -> RunPosterior:
    """What all runs say with sizes before them (12,), and noise N_a, N_g, q, J."""
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


def _drift(found: RunPosterior, noise: Array, count: int) -> Drift:
    """Parameters that kept less of their variance than what counts as determined."""
    n = len(NAMES)
    variance = np.diag(found.covariance)
    known = np.flatnonzero(variance[:n] < thresholds.DETERMINED * SIZES**2)
    values = found.mean[:n] + [name.startswith("acc_scale") for name in NAMES]
    force, rate, out, jitter = map(float, noise)
    return Drift(
        tuple(NAMES[i] for i in known),
        values[known],
        found.covariance[np.ix_(known, known)],
        tuple(name for i, name in enumerate(NAMES) if i not in known),
        (force, rate, out, jitter),
        found.chi2,
        count - len(known),
        found.mean[n:],
        np.sqrt(variance[n:]),
    )
