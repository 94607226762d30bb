"""Regression of a channel on temperature and time (its ramp).

    c_k = sum_i beta_i z_ik + noise of variance S_k                                (1)
    beta = (Z' W Z)^-1 Z' W c,    W = diag(1 / S)                                  (2)
    E (c_k - z_k beta)^2 = S_k (1 - h_k),    h_k = z_k (Z' W Z)^-1 z_k' / S_k      (3)

c are the coefficients of the last levels, z those of the thermometer and of the time. S
comes from a fit of the residual, in turn, below the corner of a filter if there is one;
in the end it is that of the chosen processes. A covariate is accepted if the gain of
held-out coefficients, chi^2 / 2 - 1, exceeds its standard error, chi. The thermometer's
own noise would bias (2) low, so only the part of z above that noise is used.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.noise.device_filter import without_filter
from fieldcal.noise.likelihood import Flags, Powers, whittle_likelihood
from fieldcal.noise.spectrum import CosineSpectrum
from fieldcal.noise.untimed_terms import fit_untimed_terms

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
    used : coefficients (k,) of each of them

    """

    powers: Powers
    found: dict[str, tuple[float, float]]
    used: dict[str, Array]

    def at_level(
        self, spectrum: CosineSpectrum, channel: int, level: Array
    ) -> dict[str, tuple[float, float]]:
        """`found` by (2), with the expected powers (b,) of the processes as S."""
        z = _columns(self.used, len(spectrum.last.bin))
        beta, covariance = _weighted_fit(spectrum, channel, z, level)
        return _named(self.used, beta, covariance)


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
    values = spectrum.last.values[:, channel]
    whole = _powers_of_rest(spectrum, channel, values, np.ones(len(values)))
    free = without_filter(spectrum, whole).free
    best = _regress(spectrum, channel, {}, free)
    left = dict(covariates)
    while left:
        tried = [
            _regress(spectrum, channel, {**best.used, name: left[name]}, free)
            for name in left
        ]
        one = max(tried, key=lambda f: f.log_likelihood)
        gained = 2 * (one.log_likelihood - best.log_likelihood)
        if gained / 2 - 1 <= np.sqrt(max(gained, 0.0)):
            break
        best = one
        left = {n: z for n, z in left.items() if n not in best.used}
    return CovariateFit(
        _powers_of_rest(spectrum, channel, best.rest, best.weight),
        best.found,
        best.used,
    )


@dataclass(frozen=True, slots=True)
class _Regression:
    used: dict[str, Array]
    rest: Array
    weight: Array
    found: dict[str, tuple[float, float]]
    log_likelihood: float


def _regress(
    spectrum: CosineSpectrum, channel: int, used: dict[str, Array], free: Flags
) -> _Regression:
    """Regress a channel; bins that are `free` (b,) do not tell the level of the rest.

    Else the bend of a filter would be taken for a slope towards low frequencies, where
    the covariates are.
    """
    values = spectrum.last.values[:, channel]
    z = _columns(used, len(values))
    rest: Array = values
    one, h = np.ones(len(values)), np.zeros(len(values))
    beta: Array = np.zeros(len(used))
    covariance: Array = np.zeros((len(used), len(used)))
    for _ in range(ROUNDS if used else 1):
        powers = replace(_powers_of_rest(spectrum, channel, rest, one), free=free)
        level = fit_untimed_terms(spectrum, powers).level
        beta, covariance = _weighted_fit(spectrum, channel, z, level)
        rest = values - z @ beta
        own = level[spectrum.last.bin]
        h = np.sum((z @ covariance) * z, axis=1) / own  # (3)
    powers = _powers_of_rest(spectrum, channel, rest, one)
    total = whittle_likelihood(
        level[~free], powers.power[~free].sum(axis=1), powers.count[~free].sum(axis=1)
    )
    found = _named(used, beta, covariance)
    return _Regression(used, rest, np.clip(1 - h, 1e-9, 1), found, total)


def _columns(used: Mapping[str, Array], count: int) -> Array:
    """Coefficients of covariates, (k, p), k of them."""
    return np.array(list(used.values())).reshape(len(used), count).T


def _weighted_fit(
    spectrum: CosineSpectrum, channel: int, z: Array, level: Array
) -> tuple[Array, Array]:
    """Beta (p,) of (2) with its covariance, for coefficients z (k, p) and S (b,)."""
    white = z / level[spectrum.last.bin][:, None]
    covariance = np.linalg.pinv(z.T @ white)
    return covariance @ (white.T @ spectrum.last.values[:, channel]), covariance


def _named(
    used: Iterable[str], beta: Array, covariance: Array
) -> dict[str, tuple[float, float]]:
    sigma = np.sqrt(np.diag(covariance))
    return {n: (float(b), float(s)) for n, b, s in zip(used, beta, sigma, strict=True)}


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
