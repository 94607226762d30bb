"""Whittle's likelihood of the powers for a set of processes, and its maximum.

    S_b = sum_i theta_i g_ib(T_i)                                                  (1)
    log L = - sum_b nu_b (log S_b + P_b / S_b) / 2                                 (2)
    J = sum_b nu_b d_b d_b' / 2,    d_b = grad log S_b                             (3)

theta are variances, g the columns of `spectrum`, P the mean power of the nu
coefficients of a bin; parameters are log theta and log T. The maximum is found by
Fisher's scoring. A fold f of the coefficients is predicted from all others by one step
from the maximum,

    x_-f = x - (J - J_f)^-1 grad log L_f                                           (4)

and scores log L_f(x_-f). Sources: Whittle 1953; for (4) Stone 1977.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.spectrum import CosineSpectrum

Flags = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

TIMED_TERMS = ("G", "BT")
"""Terms that have a correlation time: Gauss-Markov, and flicker up to one."""

ALIKE = 0.01
"""Least difference of the logarithms of two correlation times."""

MOST_STEPS = 60
LONGEST_STEP = 1.5
CLOSE = 1e-4
NOTHING = 0.05
"""Least information about the log of a variance for its process to be kept: below it,
the uncertainty of the variance spans a factor of eighty."""


@dataclass(frozen=True, slots=True)
class Powers:
    """Powers of one channel, to which processes are fitted.

    Attributes
    ----------
    power, count : (b, folds) sums of squares, and their numbers
    free : (b,) bins that are left out of the fit and have a level of their own

    """

    power: Array
    count: Array
    free: Flags

    def scaled(self, dispersion: float) -> Powers:
        """Powers with the information reduced by a dispersion."""
        return replace(
            self, power=self.power / dispersion, count=self.count / dispersion
        )


@dataclass(frozen=True, slots=True)
class NoiseFit:
    """Processes at their most likely sizes.

    Attributes
    ----------
    terms : symbols; "G" may come several times
    x : log of the variances, then of the correlation times of those that have one
    information : of x, (3)
    level : (b,) expected powers
    log_likelihood : (2)
    scores : (folds,) of each fold as predicted from the others, (4)

    """

    terms: tuple[str, ...]
    x: Array
    information: Array
    level: Array
    log_likelihood: float
    scores: Array

    @property
    def covariance(self) -> Array:
        """Covariance of x."""
        return np.linalg.pinv(self.information, hermitian=True)

    @property
    def timed(self) -> list[int]:
        """Indices of the terms with a correlation time."""
        return [i for i, term in enumerate(self.terms) if term in TIMED_TERMS]


def expected_powers(
    spectrum: CosineSpectrum, terms: tuple[str, ...], x: Array
) -> tuple[Array, Array]:
    """Expected powers (b,) and the gradient of their logarithms (b, p), (1)."""
    times = iter(range(len(terms), len(x)))
    columns = np.empty((len(spectrum.frequency), len(x)))
    for i, term in enumerate(terms):
        size = np.exp(x[i])
        if term in TIMED_TERMS:
            j = next(times)
            of = spectrum.markov if term == "G" else spectrum.flicker
            column, slope = of(float(x[j]))
            columns[:, j] = size * slope
        else:
            column = spectrum.column(term)
        columns[:, i] = size * column
    level = columns[:, : len(terms)].sum(axis=1)
    return level, columns / level[:, None]


def information_matrix(powers: Powers, slopes: Array) -> Array:
    """J of (3), (p, p), by slopes (b, p) of the logarithms of expected powers."""
    count = np.where(powers.free, 0.0, powers.count.sum(axis=1))
    information: Array = 0.5 * slopes.T @ (count[:, None] * slopes)
    return information


def whittle_likelihood(level: Array, power: Array, count: Array) -> float:
    """Log likelihood of sums of squares, (2)."""
    return -0.5 * float(np.sum(count * np.log(level) + power / level))


def fit_processes(
    spectrum: CosineSpectrum, powers: Powers, terms: tuple[str, ...], start: Array
) -> NoiseFit | None:
    """Fit processes by maximum likelihood; None if one vanishes, or two are one."""
    used = ~powers.free
    power, count = powers.power[used].sum(axis=1), powers.count[used].sum(axis=1)
    within = parameter_bounds(spectrum, terms)
    x = np.clip(start, *within)
    level, slopes = (a[used] for a in expected_powers(spectrum, terms, x))
    best, damping = whittle_likelihood(level, power, count), 1e-3
    for _ in range(MOST_STEPS):
        gradient = 0.5 * slopes.T @ (power / level - count)
        information = 0.5 * slopes.T @ (count[:, None] * slopes)
        step = _step(information, gradient, damping)
        trial = np.clip(x + step, *within)
        trial_level, trial_slopes = (
            a[used] for a in expected_powers(spectrum, terms, trial)
        )
        found = whittle_likelihood(trial_level, power, count)
        if not found >= best:
            damping *= 8
            if damping > 1e8:
                break
            continue
        moved = float(np.max(np.abs(trial - x)))
        x, level, slopes = trial, trial_level, trial_slopes
        gained, best, damping = found - best, found, max(damping / 5, 1e-9)
        told = 0.5 * count @ slopes[:, : len(terms)] ** 2
        if (told < NOTHING).any():
            return None
        if moved < CLOSE or (gained < 1e-6 and moved < 0.1):
            break
    if _two_are_one(terms, x):
        return None
    return _finished_fit(spectrum, powers, terms, x)


def _two_are_one(terms: tuple[str, ...], x: Array) -> bool:
    """Whether two Gauss-Markov processes have one time: only their sum is known."""
    timed = [term for term in terms if term in TIMED_TERMS]
    times = sorted(t for term, t in zip(timed, x[len(terms) :], strict=True)
                   if term == "G")  # fmt: skip
    return bool((np.diff(times) < ALIKE).any())


def parameter_bounds(
    spectrum: CosineSpectrum, terms: tuple[str, ...]
) -> tuple[Array, Array]:
    """Least and greatest of each parameter, (p,) both."""
    times = sum(term in TIMED_TERMS for term in terms)
    low, high = spectrum.log_times
    return (
        np.array([-np.inf] * len(terms) + [low] * times),
        np.array([np.inf] * len(terms) + [high] * times),
    )


def _step(information: Array, gradient: Array, damping: float) -> Array:
    damped = information + damping * np.diag(np.diag(information) + 1e-12)
    step = np.linalg.solve(damped, gradient)
    longest = float(np.max(np.abs(step)))
    out: Array = step * min(1.0, LONGEST_STEP / max(longest, 1e-300))
    return out


def _finished_fit(
    spectrum: CosineSpectrum, powers: Powers, terms: tuple[str, ...], x: Array
) -> NoiseFit:
    level, slopes = expected_powers(spectrum, terms, x)
    used = np.where(powers.free, 0.0, 1.0)
    count = powers.count * used[:, None]
    power = powers.power * used[:, None]
    information = information_matrix(powers, slopes)
    total = whittle_likelihood(level, power.sum(axis=1), count.sum(axis=1))
    total += _free_likelihood(powers)
    scores = np.empty(count.shape[1])
    for f in range(len(scores)):
        own = 0.5 * slopes.T @ (count[:, f][:, None] * slopes)
        gradient = 0.5 * slopes.T @ (power[:, f] / level - count[:, f])
        held = x - _step(information - own, gradient, 1e-6)
        held_level = expected_powers(spectrum, terms, held)[0]
        scores[f] = whittle_likelihood(held_level, power[:, f], count[:, f])
    scores += _free_scores(powers)
    return NoiseFit(terms, x, information, level, total, scores)


def _free_scores(powers: Powers) -> Array:
    """Scores (folds,) of the bins that have a level of their own, from other folds."""
    power, count = powers.power[powers.free], powers.count[powers.free]
    others = power.sum(axis=1, keepdims=True) - power
    number = count.sum(axis=1, keepdims=True) - count
    with np.errstate(divide="ignore", invalid="ignore"):
        level = others / number
        each = -0.5 * (count * np.log(level) + power / level)
    known = (count > 0) & (number > 0) & (others > 0)
    scores: Array = np.where(known, each, 0.0).sum(axis=0)
    return scores


def _free_likelihood(powers: Powers) -> float:
    """Log likelihood of the bins that have a level of their own."""
    power, count = (a[powers.free].sum(axis=1) for a in (powers.power, powers.count))
    there = (count > 0) & (power > 0)
    power, count = power[there], count[there]
    return whittle_likelihood(power / count, power, count)
