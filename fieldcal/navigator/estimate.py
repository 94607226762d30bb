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
from fieldcal.navigator.large_angles import beyond_first_order
from fieldcal.navigator.mistakes import ATTITUDES, SCATTER, mistakes
from fieldcal.navigator.run_rows import (
    RunPosterior,
    RunRows,
    Setup,
    posterior,
    run_rows,
)
from fieldcal.navigator.solution import Run

NAMES = tuple(f"{g}.{x}" for g in ("acc_bias", "acc_scale", "gyr_bias") for x in "xyz")
UNITS = ("m/s^2",) * 3 + ("1",) * 3 + ("rad/s",) * 3

SIZES = 3.0 * np.repeat([priors.BIAS_ACC, priors.SCALE, priors.BIAS_GYR], 3)
"""Before anything is seen: a few times what consumer grade reaches."""

NEAR = {"fatol": 0.02, "xatol": 0.03}
"""Where the search for N_a, N_g, q and J ends: ln of the evidence, and of each."""

PASSES = 2
"""How often rows are taken about what was found."""

ASIDE = np.repeat([1e-7, 1e-4, 1e-4], 3)
"""Steps of rate, force and angle by which slopes are taken: small ones of each."""

LEAST = (1e-6, 1e-8, 1e-6, 1e-6)
MOST = (0.1, 1e-2, 10.0, 0.3)
"""N_a in m/s^2/sqrt(Hz), N_g in rad/s/sqrt(Hz), q in m/s and m, J in m/s^2."""


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
    off : what of the set-up is not as it was told, as `mistakes` name it

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
    off: tuple[str, ...]

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
    """Estimate the parameters from runs at rest, (1), (2).

    Where the runs are likelier with a base that is not level, with another azimuth or
    with a run that was not set as entered, by more than such mistakes are rare, that is
    what they are solved with, and it is said.
    """
    linear = [run_rows(run, setup, r) for r, run in enumerate(runs)]
    best, off = _solved(runs, linear, setup), list[str]()
    while True:
        tried = {
            name: _solved(runs, linear, other, best.noise)
            for name, other in mistakes(best.setup)
            if name not in off
            and (_hoped(best, other) or (name == ATTITUDES and best.scatters))
        }
        name = max(tried, key=lambda n: tried[n].found.score, default="")
        if not name or tried[name].gain(best) < thresholds.SAME:
            break
        best, off = tried[name], [*off, name]
    return _drift(best, (*off, *([SCATTER] if best.scatters else ())))


@dataclass(frozen=True, slots=True)
class _Solved:
    """A set-up with the noise and the parameters of its greatest evidence."""

    setup: Setup
    rows: Sequence[RunRows]
    noise: Array
    found: RunPosterior

    @property
    def sizes(self) -> Array:
        """Before anything is seen, (12,)."""
        return np.concatenate([SIZES, self.setup.common])

    def gain(self, other: _Solved) -> float:
        """Evidence over that of another set-up, ln."""
        return self.found.score - other.found.score

    @property
    def scatters(self) -> bool:
        """Whether the runs differ by more than what else is known of them."""
        calm = posterior(self.rows, self.sizes, _calm(self.noise)).score
        return self.found.score - calm > thresholds.SAME


def _calm(noise: Array) -> Array:
    """The same without scatter of the runs."""
    return np.append(noise[:3], LEAST[3])


def _hoped(best: _Solved, other: Setup) -> bool:
    """Whether another set-up is likelier at the noise of the best, or without scatter.

    What a mistake leaves unexplained is in the scatter of the runs; what all attitudes
    do to it shows only once it is sought.
    """
    rows, sizes = _set(best.rows, other), np.concatenate([SIZES, other.common])
    each = (best.noise, _calm(best.noise))
    score = max(posterior(rows, sizes, noise).score for noise in each)
    return score > best.found.score


def _set(rows: Sequence[RunRows], setup: Setup) -> list[RunRows]:
    """Rows with each attitude as well known as a set-up says."""
    pairs = zip(rows, setup.own.tolist(), strict=True)
    return [replace(one, sigma=sigma) for one, sigma in pairs]


def _solved(
    runs: Sequence[Run],
    linear: Sequence[RunRows],
    setup: Setup,
    near: Array | None = None,
) -> _Solved:
    """Parameters of a set-up; the noise is sought near some if given."""
    linear, sizes = _set(linear, setup), np.concatenate([SIZES, setup.common])
    rows, noise = linear, near
    for _ in range(PASSES):
        noise = _likeliest(rows, sizes, noise)
        mean = posterior(rows, sizes, noise).mean
        own = [one.own(noise, mean) for one in rows]
        pairs = zip(linear, runs, strict=True)
        rows = [
            _about(one, run, setup, r, mean, own[r])
            for r, (one, run) in enumerate(pairs)
        ]
    noise = _likeliest(rows, sizes, noise)
    return _Solved(setup, rows, noise, posterior(rows, sizes, noise))


def _likeliest(rows: Sequence[RunRows], sizes: Array, near: Array | None) -> Array:
    """N_a, N_g, q, J of the greatest evidence, (4,); sought near some if given."""
    from scipy.optimize import minimize

    least, most = np.log(LEAST), np.log(MOST)

    def worse(logs: Array) -> float:
        inside = np.clip(logs, least, most)
        beyond = float(np.sum((logs - inside) ** 2))
        return 100.0 * beyond - posterior(rows, sizes, np.exp(inside)).score

    start = _coarsely(worse, least, most) if near is None else np.log(near)
    found = minimize(worse, start, method="Nelder-Mead", options=NEAR)
    return np.asarray(np.exp(np.clip(found.x, least, most)))


def _about(
    one: RunRows, run: Run, setup: Setup, r: int, mean: Array, own: Array
) -> RunRows:
    """Rows of a run that are linear about errors (12,) and phi_r (3,), not about none.

    A base that leans by a degree takes 1.5 mm/s^2 off gravity.
    """
    c = setup.attitudes[r]
    force = force_home(setup.gravity)
    f = c.T @ force
    bias, scale, rate, phi = np.split(mean, 4)
    errors = np.concatenate([rate, bias + scale * f, phi + own])

    def beyond(at: Array) -> Array:
        inputs = (setup.earth, force)
        more = beyond_first_order(run.step, len(run.values), c, inputs, at)
        return np.asarray(more[:, list(setup.used)].ravel())

    there = beyond(errors)
    slopes = [(beyond(errors + d) - there) / d.max() for d in np.diag(ASIDE)]
    by_rate, by_force, by_phi = np.split(np.column_stack(slopes), 3, axis=1)
    more = np.hstack([by_force, by_force * f, by_rate, by_phi])
    y = one.y - there + more @ mean + by_phi @ own
    return replace(one, y=y, design=one.design + more, turn=one.turn + by_phi)


def _coarsely(worse: Callable[[Array], float], least: Array, most: Array) -> Array:
    """Where a coarse grid of the logarithms is best."""
    parts = [np.linspace(a, b, 5)[1:-1] for a, b in zip(least, most, strict=True)]
    points = np.stack(np.meshgrid(*parts), axis=-1).reshape(-1, len(least))
    return np.asarray(points[int(np.argmin([worse(p) for p in points]))])


def _drift(best: _Solved, off: tuple[str, ...]) -> Drift:
    """Parameters that kept less of their variance than what counts as determined."""
    n, found = len(NAMES), best.found
    variance = np.diag(found.covariance)
    known = np.flatnonzero(variance[:n] < thresholds.DETERMINED * SIZES**2)
    values = found.mean[:n] + [name.startswith("acc_scale") for name in NAMES]
    force, rate, out, jitter = map(float, best.noise)
    return Drift(
        tuple(NAMES[i] for i in known),
        values[known],
        found.covariance[np.ix_(known, known)],
        tuple(name for i, name in enumerate(NAMES) if i not in known),
        (force, rate, out, jitter),
        found.chi2,
        sum(len(one.y) for one in best.rows) - len(known),
        found.mean[n:],
        np.sqrt(variance[n:]),
        off,
    )
