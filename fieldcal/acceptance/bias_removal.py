"""Detects gyroscopes whose bias the device subtracts at rest.

Means of n windows of an output with an offset of exactly zero, each with the error that
white noise gives it, have

    chi2 = sum over windows of (mean / sigma)^2,   P(chi2 or less; n)              (1)

If biases repeat within s_b from run to run, and the gyroscopes measure the Earth's
rate, the probability of means so close to zero, with an error s of each axis over all
windows, is

    P = product over axes of min(1, 4 s / (sqrt(2 pi) sqrt(s_b^2 + w_E^2 / 3)))    (2)

A device removes it where it sees that it rests. One that is held in a hand is turned to
and fro all the time and never sees that; its means are zero within that motion,
whatever the bias, so that nothing is said of it.

If a device removes the bias of its gyroscopes at rest, chi2 (1) is not significant.
The offset after a turn is removed again within seconds, so the means are c of

    W(t) = c + d exp(-t / tau)                                                     (3)

in each window, with the tau that gives the least residual over all windows. The removal
also suppresses slow noise, so sigma is that of the noise at high frequencies: the
median of the periodogram over ln 2, or that of a lower octave if a filter has reduced
the upper ones. A device may instead take the mean of its first T seconds at rest as its
bias until the next turn. Then the noise of this mean is in the whole window, and the
previous bias in its beginning. The means are c of

    W(t) = c + d (t < T'),   sigma^2 = sigma_c^2 + noise^2 / (T rate)              (4)

with the T' of the least residual, and any T. The likelihood ratio of either to
gyroscopes that keep a bias of spread s_b, with an error e that depends on the position,
is

    B = prod N(c; 0, sigma^2) / prod N(c; 0, sigma_c^2 + e^2 + s_b^2 everywhere)   (5)

over windows and axes. Gyroscopes of known bias have only the Earth's rate w, in an
unknown direction; the denominator of (5) is then, with m = |c|,

    p(c) = N(c; 0, sigma_c^2) exp(-w^2 / 2 sigma_c^2) sinh(x) / x,  x = m w / sigma_c^2
                                                                                   (6)
A device that follows its bias over a minute or more leaves in each window another part
of what turns and noise have put into it: means of zero with some scatter, instead of
exactly zero. sigma^2 of (5) has this scatter as well (`LEFT_OVER`).
An autopilot that reports the offset that it subtracts has, with even odds, averaged it
over any T when it started: a bias of s_b^2 = noise^2 / (T rate) then remains. Of
gyroscopes with a bias at most one in x has a B above x; a share TRACKING of all devices
removes the bias.
Device axes, rad/s. Source: Markov's inequality for a likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.acceptance.window_cells import SPECTRUM, WindowCells
from fieldcal.acceptance.zero_rates import (
    log_odds_of_no_bias,
    zero_rates,
)
from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.probability import chi2_tail, probability_of_log_odds
from fieldcal.core.samples import GYR, UNITS, Array, Block, Index
from fieldcal.windows import Average

MIN_WINDOWS = 2
"""Fewest windows for (1)."""

TRACKING = 0.01
"""Share of devices that subtract their bias at rest; low-cost ones often do."""

DOUBT = 0.1
"""Probability of such a device above which there is no GO."""

POSITION_DEPENDENCE = (0.0, 0.01, 0.03, 0.1)
"""Dependence of gyroscopes on the position, mostly g-sensitivity, as part of the spread
of their biases; all are equally likely. The Earth's rate is added except for the first,
as in a simulation."""

LEFT_OVER = POSITION_DEPENDENCE
"""What a device that follows its bias slowly leaves of it in a window, as parts of the
same spread; all are equally likely."""

LAGS = np.geomspace(0.25, 16.0, 49)
"""Time constants of (3), and times of (4), that are tried, s."""

MOVED, MOVED_S = 2e-3, 0.25
"""Spread of mean rates over so long, rad/s and s, beyond which a device moves: 0.1
deg/s. A hand makes 5e-3 to 2e-2, and noise of a low-cost gyroscope at rest 6e-4."""

UNKNOWN = np.full(3, np.nan)
"""Biases of which nothing is known."""


@dataclass(frozen=True, slots=True)
class BiasSpread:
    """Possible biases of gyroscopes from which none is subtracted.

    Attributes
    ----------
    repeat : spread from run to run, 1 sigma, rad/s
    averaged : whether the device reports a constant offset that it subtracts

    """

    repeat: float
    averaged: bool = False


def bias_removal_probability(
    windows: Sequence[Average],
    block: Block,
    keeps: BiasSpread,
    least: float,
    seen: tuple[Array, Array] = (UNKNOWN, UNKNOWN),
) -> tuple[float, str]:
    """Probability that the device subtracts its bias at rest, (5), and chi2 in words.

    0 if the means differ significantly from zero, if there are too few, or if a hand
    holds the device. `seen` are estimated biases and their errors, (3,) each, rad/s.
    They count on axes that read zero in all samples at rest (`zero_rates`).
    """
    held = [one for w in windows if len(one := block.between(w.start, w.end))]
    if _never_rests(held) or len(held) < MIN_WINDOWS:
        return 0.0, ""
    zero = zero_rates(held)
    bias, sigma = (part[zero] for part in seen)
    log_odds = log_odds_of_no_bias(bias, sigma, keeps.repeat)
    if keeps.averaged:
        log_odds -= float(np.logaddexp(log_odds, 0.0) - np.log(2.0))
    log_odds += np.log(TRACKING)
    if zero.all():
        return float(probability_of_log_odds(log_odds)), "(all samples are zero)"
    return _removal_behind_noise(held, np.flatnonzero(~zero), keeps, least, log_odds)


def _removal_behind_noise(
    held: Sequence[Block], axes: Index, keeps: BiasSpread, least: float, prior: float
) -> tuple[float, str]:
    """The probability with that of some axes, from prior log odds, and chi2."""
    cells = [WindowCells.of(one, axes) for one in held if len(one) >= SPECTRUM]
    if not cells:
        return 0.0, ""
    second = np.median([one.noise_of_a_second for one in cells], axis=0)
    left = [second / np.sqrt(s) for s in LAGS] if keeps.averaged else []
    biases = [np.full(len(axes), keeps.repeat), *left]
    stays = _KeptBias(keeps.repeat, biases)
    settled, own = _settled_means(cells)
    found = [_removal_probability(settled, own, [own], stays, least, prior)]
    found += [
        _removal_probability(means, own, every, stays, least, prior)
        for means, own, every in _zeroed_means(cells)
    ]
    return max(found)


def _never_rests(held: Sequence[Block]) -> bool:
    """Whether most windows show a motion that no device takes for rest."""
    moves = []
    for one in held:
        parts = int((one.t[-1] - one.t[0]) / MOVED_S) if len(one) > 1 else 0
        if 1 < parts <= len(one):
            each = len(one) // parts
            means = one.gyr[: each * parts].reshape(parts, each, 3).mean(axis=1)
            moves.append(float(np.median(np.nan_to_num(means.std(axis=0)))))
    return bool(moves) and float(np.median(moves)) > MOVED


def _removal_probability(
    means: Array,
    own: Array,
    every: Sequence[Array],
    keeps: _KeptBias,
    least: float,
    prior: float,
) -> tuple[float, str]:
    """Probability (5) for means about zero, whose error is one of `every`.

    `prior` are the log odds of a device that subtracts its bias.
    """
    every = [np.hypot(one, part * keeps.repeat) for one in every for part in LEFT_OVER]
    seen = np.isfinite(means) & (own > 0)
    count, axes = int(seen.sum()), means.shape[1]
    if count < axes * MIN_WINDOWS or not seen.any(axis=0).all():
        return 0.0, ""
    sigma = min(
        every, key=lambda one: _minus_two_log_likelihood(means[seen], one[seen])
    )
    chi2, larger = chi2_about_zero(means[seen], sigma[seen])
    if larger < least:
        return 0.0, ""
    zero = _log_mean_exp(
        [-0.5 * _minus_two_log_likelihood(means[seen], one[seen]) for one in every]
    )
    stays = keeps.likelihood(means, own, seen)
    odds = zero - stays + prior  # (5)
    chance = float(probability_of_log_odds(odds))
    return chance, f"(χ² about zero {chi2:.2g} of {count} means)"


def _minus_two_log_likelihood(means: Array, sigma: Array) -> float:
    """Minus twice the log likelihood of zero means, without a constant."""
    return float(np.sum((means / sigma) ** 2 + 2 * np.log(sigma)))


def _earth_rate_log_likelihood(means: Array, own: Array) -> float:
    """Log likelihood of the Earth's rate in unknown directions, without a constant."""
    var = own**2
    one = var.mean(axis=1)
    x = np.maximum(np.linalg.norm(means, axis=1) * EARTH_RATE / one, 1e-9)
    sphere = np.log(-np.expm1(-2 * x) / (2 * x)) + x - EARTH_RATE**2 / (2 * one)  # (6)
    return -0.5 * _minus_two_log_likelihood(means, own) + float(np.sum(sphere))


def chi2_about_zero(means: Array, sigma: Array) -> tuple[float, float]:
    """Chi-squared of means, and the probability of a larger one, (1)."""
    chi2 = float(np.sum((means / sigma) ** 2))
    return chi2, chi2_tail(chi2, len(means))


def chance_near_zero(sigma: Array, spread: float | Array) -> float:
    """Probability that offsets of a spread come so close to zero on all axes, (2)."""
    return float(np.minimum(4 * sigma / np.sqrt(2 * np.pi) / spread, 1.0).prod())


def _settled_means(cells: Sequence[WindowCells]) -> tuple[Array, Array]:
    """Values c of (3) that the gyroscopes settle to, and their errors, (w, 3) each."""
    return _fit_constants(cells, LAGS, lambda t, lags: np.exp(-t / lags))


def _zeroed_means(
    cells: Sequence[WindowCells],
) -> Iterator[tuple[Array, Array, Sequence[Array]]]:
    """Means c of (4), their own error, and that with the noise of any T."""
    first, last = max(c.t[0] for c in cells), min(c.t[-1] for c in cells) / 2
    times = LAGS[(first < LAGS) & (last > LAGS)]
    if not len(times):
        return
    means, own = _fit_constants(cells, times, lambda t, ends: 1.0 * (t < ends))
    of_second = np.array([one.noise_of_a_second for one in cells])
    yield means, own, [np.hypot(own, of_second / np.sqrt(s)) for s in LAGS]


def _fit_constants(
    cells: Sequence[WindowCells], times: Array, shape: Callable[[Array, Array], Array]
) -> tuple[Array, Array]:
    """Fit constants with a shape; returns those for the best time, and errors."""
    found = [one.fit_constants(shape(one.t, times[:, None])) for one in cells]
    means, errors, chi2 = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    best = int(np.argmin(np.nansum(chi2, axis=(1, 2))))
    return means[best], errors[best]


@dataclass(frozen=True, slots=True)
class _KeptBias:
    """Gyroscopes that keep their bias, the denominator of (5).

    Attributes
    ----------
    repeat : spread of biases from run to run, 1 sigma, rad/s
    biases : (3,) each, possible spreads of the bias in this run; the first is as likely
        as all others together

    """

    repeat: float
    biases: Sequence[Array]

    def likelihood(self, means: Array, own: Array, seen: NDArray[np.bool_]) -> float:
        """Log likelihood of means (w, 3), without a constant."""
        first, *others = (
            self._likelihood_of_spread(b, means, own, seen) for b in self.biases
        )
        if not others:
            return first
        return float(np.logaddexp(first, _log_mean_exp(others)) - np.log(2.0))

    def _likelihood_of_spread(
        self, bias: Array, means: Array, own: Array, seen: NDArray[np.bool_]
    ) -> float:
        whole = seen.all() and seen.shape[1] == len(UNITS[GYR])
        ways = [
            self._likelihood_of_dependence(bias, means, own, seen, part)
            for part in POSITION_DEPENDENCE
        ]
        return _log_mean_exp(
            [*ways, *([_earth_rate_log_likelihood(means, own)] if whole else [])]
        )

    def _likelihood_of_dependence(
        self,
        bias: Array,
        means: Array,
        own: Array,
        seen: NDArray[np.bool_],
        dependence: float,
    ) -> float:
        felt = (dependence * self.repeat) ** 2 + (
            EARTH_RATE**2 / 3 if dependence else 0.0
        )
        info = np.where(seen, 1 / np.where(seen, own**2 + felt, 1.0), 0.0)
        value, var = np.where(seen, means, 0.0), bias**2
        total, pull = info.sum(axis=0), (info * value).sum(axis=0)
        square = (info * value**2).sum(axis=0) - var * pull**2 / (1 + var * total)
        wide = np.log1p(var * total).sum() - np.log(info[seen]).sum()
        return -0.5 * float(square.sum() + wide)


def _log_mean_exp(logs: Sequence[float]) -> float:
    """Log of the mean of exponentials."""
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))
