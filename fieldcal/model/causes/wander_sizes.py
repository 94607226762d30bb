"""Size of random walk and flicker of the biases within windows, before any fit.

For three rows d, d', d'' of about the same length l, tau apart, the second difference
does not contain a straight line, and has the variance

    var(d'' - 2 d' + d) = s''^2 + 4 s'^2 + s^2 + 4 D(tau) - D(2 tau)                (1)

with s the white noise of a row and D(tau) the mean squared difference of two means tau
apart: for a random walk of q per sqrt(s), and for flicker from cosines k of variance
a^2 / k,

    D = q^2 [tau - l / 3]                                                           (2)
    D = a^2 / 2 [(x + 1)^2 ln(x + 1) + (x - 1)^2 ln|x - 1| - 2 x^2 ln x]            (3)

with x = tau / l. The size follows from the median of the squares over (1). The later
half of each window is used, when settling after a turn is over. With r that median over
the median of chi-squared, ln r has the standard deviation 2.7 / sqrt(n), with n the
number of rows for white noise, and of rows that do not overlap for walks. Source: IEEE
Std 952 and Barnes et al. 1971; (3) is the sum of their variances of averages.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.cause import MIN_WINDOWS, TRIADS
from fieldcal.model.rows.reduce import Rows
from fieldcal.physics.effect import Scatter

CHI2_MEDIAN, MEDIAN_LOG_SCATTER = 0.4549, 2.7
"""Of chi squared with one degree of freedom: median; scatter of the median's ln."""

VALUES_PER_SIZE = 4
"""Values of v for each value of `priors.SIZES`."""

SIZES: Array = np.geomspace(priors.SIZES[0], priors.SIZES[-1], VALUES_PER_SIZE * 32 + 1)

DENSITY: Array = (
    np.interp(np.log(SIZES), np.log(priors.SIZES), priors.density()) / VALUES_PER_SIZE
)
"""Probability of each."""

DIFFERENCE_LAGS = (1, 3, 9)
"""Distances of the three means of a difference, in rows."""

MIN_DIFFERENCES = 8
"""Least number of differences from which a size is estimated."""

MIN_RATIO = 1e-12
"""Of ratios, where a channel repeats one value."""


class Differences(NamedTuple):
    """Second differences of the means of one channel.

    Attributes
    ----------
    squares : (n,) squares of the differences
    white : (n,) variance from white noise
    walks, flickers : (n,) further variance if q, or a, is 1
    alone : number of differences that do not overlap

    """

    squares: Array
    white: Array
    walks: Array
    flickers: Array
    alone: float

    def scores(self, grown: Array, squares: Array) -> Array:
        """Log likelihood of squared sizes (v,); `grown` (n,) is variance at size 1."""
        known = self.squares / (self.white + np.multiply.outer(squares, grown))
        ratio = np.maximum(np.median(known, axis=1) / CHI2_MEDIAN, MIN_RATIO)
        out: Array = -self.alone / 2 * (np.log(ratio) / MEDIAN_LOG_SCATTER) ** 2
        return out


def wander_sizes(rows: Rows, unit: Array) -> tuple[Array, Array, Array]:
    """Sizes of random walk, per sqrt(s), and flicker of each output, (6,) each.

    Root mean squares over all sizes, including zero, weighted by their probabilities.
    The third result is the probability of flicker, (6,), given that an output has
    either. Few windows have flicker as a permanent group, so here it is zero.
    `unit` (6,) are outputs per SI unit.
    """
    walk, chance = _walk(rows)
    flicker = np.repeat([priors.FLICKER_ACC, priors.FLICKER_GYR], 3)
    out, evidence = np.zeros((2, 6)), np.zeros((2, 6))
    few = len(np.unique(rows.x.position)) < MIN_WINDOWS
    for _, triad in TRIADS:
        at = list(triad)
        seen = [
            [d for lag in DIFFERENCE_LAGS for d in _differences(rows, c, lag)]
            for c in at
        ]
        by = WanderHypotheses(walk[at] * unit[at], chance, priors.SINGLE_AXIS_SHARE)
        out[0, at], evidence[0, at] = by.sizes(
            [[(d, d.walks) for d in some] for some in seen]
        )
        if few:
            evidence[1, at] = -np.inf
            continue
        by = WanderHypotheses(flicker[at] * unit[at], priors.FLICKER_CHANCE, 0.0)
        out[1, at], evidence[1, at] = by.sizes(
            [[(d, d.flickers) for d in some] for some in seen]
        )
    return out[0], out[1], probability_of_log_odds(evidence[1] - evidence[0])


class WanderHypotheses(NamedTuple):
    """Hypotheses: all axes of a triad wander, one axis alone, or none.

    Attributes
    ----------
    typical : (3,) size of each axis at v = 1
    chance : prior probability that axes wander
    alone : part of it that only one axis does

    """

    typical: Array
    chance: float
    alone: float

    def sizes(
        self, seen: Sequence[Sequence[tuple[Differences, Array]]]
    ) -> tuple[Array, float]:
        """Root mean square size of each axis, and log evidence that it is not zero.

        `seen` has, for each axis, differences with their variance at size 1.
        """
        square = np.append(0.0, SIZES) ** 2
        every = np.zeros((3, len(square)))
        for one, typical, score in zip(seen, self.typical, every, strict=True):
            for d, grown in one:
                score += d.scores(grown, square * typical**2)
        nothing, own = every[:, 0], every[:, 1:]
        others = nothing.sum() - nothing
        together = own.sum(axis=0) + np.log(self.chance * DENSITY)
        with np.errstate(divide="ignore"):  # none of one axis alone
            alone = own + others[:, None] + np.log(self.chance * self.alone * DENSITY)
        none = nothing.sum() + np.log(1 - self.chance)
        total = np.logaddexp.reduce([none, *together, *alone.ravel()])
        weight = np.exp(together - total) + np.exp(alone - total)
        out = self.typical * np.sqrt(weight @ square[1:])
        something = float(np.logaddexp.reduce([*together, *alone.ravel()]))
        return np.where([bool(one) for one in seen], out, 0.0), something


def _walk(rows: Rows) -> tuple[Array, float]:
    """Typical walk of each channel, (6,), and its prior, by the catalogue."""
    (effect,) = (
        e
        for e in catalogue().values()
        if isinstance(e, Scatter) and len(e.params) == len(CHANNELS)
    )
    return np.array([p.typical for p in effect.params]), effect.chance(rows.x)


def _differences(rows: Rows, c: int, lag: int) -> Iterator[Differences]:
    """Differences of one channel in the later halves of windows; none if too few."""
    at = _later_half(rows, 2 * lag)
    y, sd, t = rows.y[:, c], rows.sd[:, c], rows.x.t
    known = rows.used[:, c]
    at = at[known[at] & known[at + lag] & known[at + 2 * lag]]
    if len(at) < MIN_DIFFERENCES:
        return
    length, tau = rows.length[at + lag], (t[at + 2 * lag] - t[at]) / 2
    x = np.maximum(tau / length, 1.0)
    yield Differences(
        (y[at + 2 * lag] - 2 * y[at + lag] + y[at]) ** 2,
        sd[at + 2 * lag] ** 2 + 4 * sd[at + lag] ** 2 + sd[at] ** 2,
        length * (4 * (x - 1 / 3) - (2 * x - 1 / 3)),  # (1), (2)
        4 * _flicker_structure(x) - _flicker_structure(2 * x),  # (1), (3)
        len(at) / lag,
    )


def _flicker_structure(x: Array) -> Array:
    """Mean squared difference of two means of flicker with a = 1, x lengths apart."""
    out: Array = (_squared_ln(x + 1) + _squared_ln(x - 1)) / 2 - _squared_ln(x)  # (3)
    return out


def _squared_ln(x: Array) -> Array:
    """x^2 ln x, 0 at 0."""
    out: Array = x**2 * np.log(np.maximum(x, 1e-12))
    return out


def _later_half(rows: Rows, ahead: int) -> Index:
    """Rows of the later half of each window that have another one so far ahead."""
    position = rows.x.position
    near = np.flatnonzero(position[ahead:] == position[:-ahead])
    first = np.searchsorted(position, position[near])
    count = np.searchsorted(position, position[near], side="right") - first
    out: Index = near[2 * (near - first) >= count - 1]
    return out
