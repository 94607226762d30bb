"""Regression of a channel on temperature and time (its ramp).

    c_k = sum_i beta_i z_ik + noise of variance S_k                                (1)
    beta = (Z' W Z)^-1 Z' W c,    W = diag(1 / S)                                  (2)
    E (c_k - z_k beta)^2 = S_k (1 - h_k),    h_k = z_k (Z' W Z)^-1 z_k' / S_k      (3)

c are the coefficients of the last levels, z those of the thermometer and of the time. S
comes from a fit of the residual, in turn. A covariate is accepted if the gain of
held-out coefficients, chi^2 / 2 - 1, exceeds its standard error, chi. The thermometer's
own noise would bias (2) low, so only the part of z above that noise is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.likelihood import Powers, whittle_likelihood
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.terms import fit_untimed_terms

ROUNDS = 3
"""Fits of beta and S in turn."""

NOISY = 2.0
"""Bins of a thermometer count as noise up to this multiple of its fastest ones."""


@dataclass(frozen=True, slots=True)
class CovariateFit:
    """A channel after regression on its covariates.

    Attributes
    ----------
    powers : of the residual, (b, folds)
    found : value and standard error of each accepted covariate, by name: "R", channel
        units per s, and "temperature", per degree

    """

    powers: Powers
    found: dict[str, tuple[float, float]]


def fit_covariates(
    spectrum: CosineSpectrum, channel: int, covariates: dict[str, Array]
) -> CovariateFit:
    """Subtract from a channel what follows its covariates.

    Parameters
    ----------
    spectrum : of the device
    channel : which
    covariates : coefficients (k,) of each, by name

    """
    best = _regress(spectrum, channel, {})
    left = dict(covariates)
    while left:
        tried = [
            _regress(spectrum, channel, {**best.used, name: left[name]})
            for name in left
        ]
        one = max(tried, key=lambda f: f.log_likelihood)
        gained = 2 * (one.log_likelihood - best.log_likelihood)
        if gained / 2 - 1 <= np.sqrt(max(gained, 0.0)):
            break
        best = one
        left = {n: z for n, z in left.items() if n not in best.used}
    return CovariateFit(
        _powers_of_rest(spectrum, channel, best.rest, best.weight), best.found
    )


@dataclass(frozen=True, slots=True)
class _Regression:
    used: dict[str, Array]
    rest: Array
    weight: Array
    found: dict[str, tuple[float, float]]
    log_likelihood: float


def _regress(
    spectrum: CosineSpectrum, channel: int, used: dict[str, Array]
) -> _Regression:
    values = spectrum.last.values[:, channel]
    z = np.array(list(used.values())).reshape(len(used), len(values)).T
    rest: Array = values
    one, h = np.ones(len(values)), np.zeros(len(values))
    beta: Array = np.zeros(len(used))
    covariance: Array = np.zeros((len(used), len(used)))
    for _ in range(ROUNDS if used else 1):
        powers = _powers_of_rest(spectrum, channel, rest, one)
        level = fit_untimed_terms(spectrum, powers).level
        each = level[spectrum.last.bin]
        white = z / each[:, None]
        covariance = np.linalg.pinv(z.T @ white)
        beta = covariance @ (white.T @ values)  # (2)
        rest = values - z @ beta
        h = np.sum((white @ covariance) * z, axis=1)  # (3)
    powers = _powers_of_rest(spectrum, channel, rest, one)
    total = whittle_likelihood(
        level, powers.power.sum(axis=1), powers.count.sum(axis=1)
    )
    sigma = np.sqrt(np.diag(covariance))
    found = {n: (float(b), float(s)) for n, b, s in zip(used, beta, sigma, strict=True)}
    return _Regression(used, rest, np.clip(1 - h, 1e-9, 1), found, total)


def _powers_of_rest(
    spectrum: CosineSpectrum, channel: int, rest: Array, weight: Array
) -> Powers:
    power, count = spectrum.channel_powers(channel, rest, weight)
    return Powers(power, count, np.zeros(len(power), dtype=bool))


def thermometer_covariate(spectrum: CosineSpectrum, values: Array) -> Array | None:
    """Coefficients of a temperature above its own noise; None if it is all noise.

    Parameters
    ----------
    spectrum : of the device
    values : (k,) coefficients of the last levels

    """
    where = spectrum.last.bin
    power = np.bincount(where, values**2, len(spectrum.frequency))
    count = np.bincount(where, minlength=len(spectrum.frequency))
    mean = power / np.maximum(count, 1)
    used = np.flatnonzero(count)
    quick = used[spectrum.frequency[used] > np.median(spectrum.frequency[used])]
    floor = float(np.median(mean[quick]))
    share = np.clip(1 - NOISY * floor / np.maximum(mean, 1e-300), 0.0, 1.0)
    if not (share > 0.5).any():
        return None
    return values * share[where]
