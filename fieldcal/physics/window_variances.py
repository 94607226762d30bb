"""What the variances in other windows say of the variance in one.

A variance s^2 of N degrees of freedom in each of some windows. If the true ones are
drawn from a scaled inverse chi2, s_0^2 with nu_0 degrees of freedom, then

    var ln s^2 = psi'(N / 2) + psi'(nu_0 / 2)                                       (1)
    mean ln s^2 = ln s_0^2 + psi(N / 2) - ln(N / 2) - psi(nu_0 / 2) + ln(nu_0 / 2)  (2)

Windows that are all alike have a large nu_0, and each tells of the others; where a hand
held some of them, nu_0 is small. It is at most the degrees of freedom of the others.

Source: G. K. Smyth, Linear models and empirical Bayes methods, Stat. Appl. Genet. Mol.
Biol. 3 (2004) 3, section 6.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

MIN_OTHER_WINDOWS = 3
"""Other windows that show how much windows differ."""


def variances_of_others(variance: Array, dof: Array) -> tuple[Array, Array]:
    """s_0^2 and nu_0 for each window from all others, (w, c) each.

    `variance` and `dof` are s^2 and N, (w, c); a window with less than one degree of
    freedom or without variance says nothing. nu_0 is 0 where too few others do.
    """
    told = (variance > 0) & (dof >= 1)
    half = np.where(told, dof, 2.0) / 2
    log = np.log(np.where(told, variance, 1.0)) - _digamma(half) + np.log(half)
    centre = _mean(log, told)
    log = np.where(told, log - centre, 0.0)
    count = told.sum(axis=0) - told
    mean = (log.sum(axis=0) - log) / np.maximum(count, 1)
    square = np.square(log).sum(axis=0) - np.square(log)
    spread = (square - count * mean**2) / np.maximum(count - 1, 1)
    chance = np.where(told, _trigamma(half), 0.0)
    beyond = spread - (chance.sum(axis=0) - chance) / np.maximum(count, 1)
    most = np.where(told, dof, 0.0).sum(axis=0) - np.where(told, dof, 0.0)
    nu = np.minimum(2 * _inverse_trigamma(np.maximum(beyond, 1e-9)), most)  # (1)
    prior = np.maximum(nu, 1.0) / 2
    common = np.exp(centre + mean + _digamma(prior) - np.log(prior))  # (2)
    enough = count >= MIN_OTHER_WINDOWS
    return np.where(enough, common, 1.0), np.where(enough, nu, 0.0)


def _mean(values: Array, some: NDArray[np.bool_]) -> Array:
    """Mean of each column over the rows that are meant, (c,)."""
    out: Array = (values * some).sum(axis=0) / np.maximum(some.sum(axis=0), 1)
    return out


def _digamma(x: Array) -> Array:
    """First terms of the asymptotic series."""
    out: Array = np.log(x) - 1 / (2 * x) - 1 / (12 * x**2)
    return out


def _trigamma(x: Array) -> Array:
    """First terms of the asymptotic series."""
    return 1 / x + 1 / (2 * x**2) + 1 / (6 * x**3)


def _inverse_trigamma(y: Array) -> Array:
    """Of the first two terms of the series."""
    out: Array = (1 + np.sqrt(1 + 2 * y)) / (2 * y)
    return out
