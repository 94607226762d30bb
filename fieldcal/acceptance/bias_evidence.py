"""What rates at rest say of each way in which a device may remove its biases.

The likelihood of the rates if the device removes them is divided by that if it keeps
them (`bias_cases`), or if the bias is known, as that of UNBIASED of all gyroscopes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.acceptance.bias_cases import (
    BiasSpread,
    averaged_cases,
    followed_cases,
    kept_cases,
    way_of_removal,
)
from fieldcal.acceptance.earth_rate_alone import earth_rate_alone
from fieldcal.acceptance.rest_steps import RestStep
from fieldcal.acceptance.subtracted_means import WAYS
from fieldcal.acceptance.tracked_bias import Cases, log_likelihoods
from fieldcal.core.samples import Array

UNBIASED = 0.003
"""Share of gyroscopes of known bias, as of a simulation."""

FOLLOWED_SHARE, UNSEEN_MEAN_SHARE, RECORDED_MEAN_SHARE = 0.5, 0.25, 0.25
"""Shares of devices that follow their bias, and that subtract a mean which was not
recorded, or was, among those that remove it."""


@dataclass(frozen=True, slots=True)
class Removal:
    """A way in which a device may remove its biases.

    Attributes
    ----------
    log_odds : log of its share times the likelihood ratio to devices that keep them
    how : in words

    """

    log_odds: float
    how: str


def removals_by_likelihood(
    steps: Sequence[RestStep], density: Array, keeps: BiasSpread
) -> Iterator[Removal]:
    """A bias that is followed, and means that were not recorded.

    Parameters
    ----------
    steps : of rest, (a,) rad/s
    density : (a,) spectral density of the white noise, (rad/s)^2 s
    keeps : possible biases

    """
    averaged = averaged_cases(density)
    kinds = [followed_cases(keeps, density), *np.split(averaged, len(averaged))]
    shares = [FOLLOWED_SHARE] + [UNSEEN_MEAN_SHARE / len(averaged)] * len(averaged)
    blind = [float(kind["blind"][0]) for kind in kinds]
    used = [tuple(bool(step.since_turn >= b) for step in steps) for b in blind]
    unlike = dict(zip(used, blind, strict=True))  # which leave out other means
    rivals = [kept_cases(keeps, density, one) for one in unlike.values()]
    fits = _Fit.split(steps, density, keeps, [*kinds, *rivals])
    kept = dict(zip(unlike, fits[len(kinds) :], strict=True))
    alone = {key: earth_rate_alone(steps, density, b) for key, b in unlike.items()}
    for kind, share, key, fit in zip(kinds, shares, used, fits, strict=False):
        ratio = _log_ratio(fit, kept[key], alone[key])
        how = way_of_removal(kind[int(np.argmax(fit.logs))])
        yield Removal(float(ratio) + np.log(share), how)


def removals_of_recorded_means(
    outputs: Sequence[RestStep],
    before: Sequence[RestStep],
    density: Array,
    keeps: BiasSpread,
) -> Iterator[Removal]:
    """Means that were recorded before they were subtracted, for each of `WAYS`.

    Parameters
    ----------
    outputs, before : of `steps_before_means`, (v, a) rad/s
    density, keeps : as above

    """
    cases = kept_cases(keeps, density, 0.0)
    removed, kept = (
        _Fit.split(steps, density, keeps, [cases])[0] for steps in (before, outputs)
    )
    ratios = _log_ratio(removed, kept, earth_rate_alone(outputs, density, 0.0))
    for ratio, (begins, ends) in zip(ratios, WAYS, strict=True):
        how = f"as a mean over about {ends - begins:.2g} s after each turn"
        yield Removal(float(ratio) + np.log(RECORDED_MEAN_SHARE / len(WAYS)), how)


@dataclass(frozen=True, slots=True)
class _Fit:
    """Likelihoods of a group of h cases.

    Attributes
    ----------
    logs, chi2 : (..., h) log likelihood and log of the share, and chi-squared
    means : (...) number of means

    """

    logs: Array
    chi2: Array
    means: Array

    @classmethod
    def split(
        cls,
        steps: Sequence[RestStep],
        density: Array,
        keeps: BiasSpread,
        groups: Sequence[Cases],
    ) -> list[_Fit]:
        """The fits of groups of cases."""
        cases, ends = np.concatenate(groups), np.cumsum([len(g) for g in groups])[:-1]
        logs, chi2, count = log_likelihoods(steps, density, keeps.repeat**2, cases)
        parts = [
            np.split(one, ends, axis=-1)
            for one in (logs + np.log(cases["share"]), chi2, count)
        ]
        return [cls(a, b, c[..., 0]) for a, b, c in zip(*parts, strict=True)]

    @property
    def least(self) -> Array:
        """Chi-squared of the likeliest case."""
        best = self.logs.argmax(axis=-1)[..., None]
        found: Array = np.take_along_axis(self.chi2, best, -1)[..., 0]
        return found


def _log_ratio(removed: _Fit, kept: _Fit, unbiased: Array) -> Array:
    """Log of the ratio of two likelihoods, the latter with that of known biases.

    What neither explains, such as a knock, does not tell them apart: the log is divided
    by the chi-squared of a mean.
    """
    misfit = np.minimum(removed.least, kept.least) / np.maximum(kept.means, 1.0)
    a, b = (np.logaddexp.reduce(fit.logs, axis=-1) for fit in (removed, kept))
    known = np.logaddexp(b + np.log1p(-UNBIASED), unbiased + np.log(UNBIASED))
    found: Array = (a - known) / np.maximum(misfit, 1.0)
    return found
