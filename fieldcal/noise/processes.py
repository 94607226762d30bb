"""Allan variance of each process, and the scatter of its estimate from a recording.

With the generalised covariance G(s) of the integral of a process, the half square of
the difference of neighbouring means has at lag h the covariance

    r(h) = (G(h-2t) - 4 G(h-t) + 6 G(h) - 4 G(h+t) + G(h+2t)) / (2 t^2)            (1)

and r(0) is the Allan variance at t. Of the processes

    N  -N^2 |s| / 2          K  K^2 |s|^3 / 12        B  B^2 s^2 ln|s| / (2 pi)    (2)
    Q   Q^2 at s = 0         s, T   -s^2 T^2 (u - u^2/2 + exp(-u) - 1), u = |s|/T  (3)

(a square in s drops out of (1)). The estimate of the variance from a length L,
overlapping, is chi squared with

    nu = M^2 r(0)^2 / sum (M - |h|) r(h)^2                                         (4)

degrees of freedom, M differences. Source: Greenhall and Riley 2003; IEEE 952-1997.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import TIMED_TERMS

PROCESS_UNITS = {
    "N": "{}/√Hz",
    "Q": "{}·s",
    "B": "{}",
    "K": "{}·√Hz",
    "R": "{}/s",
    "G": "{}",
}
"""Unit of each process, from that of the channel."""

DIFFERENCES_PER_TIME = 8
"""Differences in each averaging time; more of them add no information."""

NODES = 33
"""Number of correlation times that make up flicker with a cut-off."""

UNCORRELATED_TIMES = 12
"""Distance of uncorrelated differences, in averaging times."""


def allan_variance(
    terms: tuple[str, ...], x: Array, tau: Array, finest: float
) -> Array:
    """Allan variance (t,) of processes at averaging times (t,), s.

    Parameters
    ----------
    terms, x : as a `NoiseFit` has them
    tau : s
    finest : shortest correlation time in flicker that is cut off, s

    """
    at_two = generalised_covariance(terms, x, np.concatenate([tau, 2 * tau]), finest)
    one, two = np.split(at_two, 2)
    zero = generalised_covariance(terms, x, np.zeros(1), finest)[0]
    variance: Array = (3 * zero - 4 * one + two) / tau**2  # (1) at h = 0
    return variance


def difference_covariances(
    terms: tuple[str, ...], x: Array, tau: float, finest: float, lags: int
) -> Array:
    """Covariance (1) at lags of an eighth of the averaging time, (lags,)."""
    steps = np.arange(-2 * DIFFERENCES_PER_TIME, lags + 2 * DIFFERENCES_PER_TIME)
    s = np.abs(steps) * tau / DIFFERENCES_PER_TIME
    g = generalised_covariance(terms, x, s, finest)
    at = [
        g[i * DIFFERENCES_PER_TIME : i * DIFFERENCES_PER_TIME + lags] for i in range(5)
    ]
    found: Array = at[0] - 4 * at[1] + 6 * at[2] - 4 * at[3] + at[4]
    return found / (2 * tau * tau)


def generalised_covariance(
    terms: tuple[str, ...], x: Array, s: Array, finest: float
) -> Array:
    """Generalised covariance (n,) of the sum of processes at lags s, (2), (3)."""
    total = np.zeros(len(s))
    times = iter(range(len(terms), len(x)))
    for i, term in enumerate(terms):
        size = float(np.exp(x[i]))
        time = float(np.exp(x[next(times)])) if term in TIMED_TERMS else 0.0
        total += size * _covariance_of_term(term, s, time, finest)
    return total


def _covariance_of_term(term: str, s: Array, time: float, finest: float) -> Array:
    if term == "N":
        return -s / 2
    if term == "K":
        return s**3 / 12
    if term == "Q":
        return np.where(s == 0, 1.0, 0.0)
    if term == "G":
        return _markov(s, time)
    if term == "B":
        return s * s * np.log(np.where(s > 0, s, 1.0)) / (2 * np.pi)
    nodes = np.linspace(np.log(finest), np.log(time), NODES)
    weights = np.full(NODES, (nodes[1] - nodes[0]) / np.pi)
    weights[[0, -1]] /= 2
    total: Array = weights @ _markov(s, np.exp(nodes)[:, None])
    return total


def _markov(s: Array, time: Array | float) -> Array:
    u = s / time
    small = u**3 * (-1 / 6 + u * (1 / 24 - u / 120))
    whole = u + np.expm1(-u) - u * u / 2
    found: Array = -time * time * np.where(u < 0.03, small, whole)
    return found


def degrees_of_freedom(covariance: Array, tau: float, length: float) -> float:
    """Degrees of freedom of an overlapping Allan variance, (4).

    Parameters
    ----------
    covariance : (lags,) from `difference_covariances`
    tau, length : averaging time, and of the recording, s

    """
    count = max(1.0, (length - 2 * tau) / tau * DIFFERENCES_PER_TIME + 1)
    lags = np.arange(1, min(len(covariance), int(np.ceil(count))))
    other = 2 * float(np.sum((count - lags) * covariance[lags] ** 2))
    first = float(covariance[0]) ** 2
    return count**2 * first / (count * first + other)
