"""Size of random walk and flicker of the biases within windows, before any fit.

Let d, d', d'' be three rows (means of one output) of about the same length l, s, whose
middles are tau apart, s. A straight line cancels in their second difference, which has
the variance

    var(d'' - 2 d' + d) = s''^2 + 4 s'^2 + s^2 + 4 D(tau) - D(2 tau)                (1)

s, s', s'' are the standard deviations of the rows by white noise. D(tau) is the mean
squared difference of two means tau apart. For a random walk of q per sqrt(s), and for
flicker with cosines k of variance a^2 / k, it is

    D = q^2 [tau - l / 3]                                                           (2)
    D = a^2 / 2 [(x + 1)^2 ln(x + 1) + (x - 1)^2 ln|x - 1| - 2 x^2 ln x]            (3)

with x = tau / l. Each squared second difference is divided by its variance (1), and r
is the median of these ratios over the median of chi-squared. At the true size r is near
1, and ln r has the standard deviation 2.7 / sqrt(n). For white noise n is the number of
rows; for walks it is the number of differences that do not overlap, which is used here.
Only the later half of each window is used, because settling after a turn is over there.
q, a, d and s are in units of the output.
Source: IEEE Std 952 and Barnes et al. 1971; (3) is the sum of their variances of
averages.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.probability import probability_of_log_odds
from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.effects import catalogue
from fieldcal.model import detections, priors, resolutions, thresholds, tolerances
from fieldcal.model.causes.cause import TRIADS
from fieldcal.model.rows.averages import Rows
from fieldcal.physics.effect import Scatter

STEPS = resolutions.VALUES_PER_SIZE * (len(priors.SIZES) - 1)
SIZES: Array = np.geomspace(priors.SIZES[0], priors.SIZES[-1], STEPS + 1)
"""Values of v, in typical sizes, that are tried."""

DENSITY: Array = (
    np.interp(np.log(SIZES), np.log(priors.SIZES), priors.density())
    / resolutions.VALUES_PER_SIZE
)
"""Prior probability of each of `SIZES`."""


class Differences(NamedTuple):
    """Second differences of the means of one channel.

    Attributes
    ----------
    squares : (n,) squares of the differences, squared units of the output
    white : (n,) their variance by white noise
    unit_walk, unit_flicker : (n,) their further variance if q, or a, is 1
    independent : number of differences that do not overlap

    """

    squares: Array
    white: Array
    unit_walk: Array
    unit_flicker: Array
    independent: float

    def scores(self, unit_variance: Array, squared_sizes: Array) -> Array:
        """Log likelihood of squared sizes (v,), (v,).

        `unit_variance` (n,) is `unit_walk` or `unit_flicker`.
        """
        variance = self.white + np.multiply.outer(squared_sizes, unit_variance)
        median = np.median(self.squares / variance, axis=1)
        ratio = np.maximum(median / detections.SQUARE_MEDIAN, tolerances.ROUNDING)
        return (
            -self.independent / 2 * (np.log(ratio) / detections.MEDIAN_LOG_SCATTER) ** 2
        )


def wander_sizes(rows: Rows, unit: Array) -> tuple[Array, Array, Array]:
    """Sizes of random walk, per sqrt(s), and flicker of each output, (6,) each.

    Both are root mean squares over all sizes, including zero, weighted by their
    probabilities. The third result is the probability that an output has flicker, (6,),
    given that it has a random walk or flicker. With fewer windows than
    `thresholds.MIN_ALIKE`, flicker is a permanent group of the model; its size here is
    then zero. `unit` (6,) are outputs per SI unit.
    """
    walk, walk_chance = _typical_walk(rows)
    out, evidence = np.zeros((2, 6)), np.zeros((2, 6))
    few = len(np.unique(rows.x.position)) < thresholds.MIN_ALIKE
    for _, triad in TRIADS:
        at = list(triad)
        lags = detections.DIFFERENCE_LAGS
        differences = [[d for k in lags for d in _differences(rows, c, k)] for c in at]
        walks = WanderHypotheses(
            walk[at] * unit[at], walk_chance, priors.SINGLE_AXIS_SHARE
        )
        out[0, at], evidence[0, at] = walks.sizes(
            [[(d, d.unit_walk) for d in of_axis] for of_axis in differences]
        )
        if few:
            evidence[1, at] = -np.inf
            continue
        size = priors.FLICKER[at] * unit[at]
        flickers = WanderHypotheses(size, priors.FLICKER_CHANCE, 0.0)
        out[1, at], evidence[1, at] = flickers.sizes(
            [[(d, d.unit_flicker) for d in of_axis] for of_axis in differences]
        )
    return out[0], out[1], probability_of_log_odds(evidence[1] - evidence[0])


class WanderHypotheses(NamedTuple):
    """Hypotheses: all axes of a triad wander, one axis alone wanders, or none does.

    Attributes
    ----------
    typical : (3,) size of each axis at v = 1, in units of the output
    wander_chance : prior probability that all axes wander
    single_axis_share : prior probability of each single axis, as a part of that

    """

    typical: Array
    wander_chance: float
    single_axis_share: float

    def sizes(
        self, differences: Sequence[Sequence[tuple[Differences, Array]]]
    ) -> tuple[Array, float]:
        """Root mean square size of each axis, (3,), and log evidence of any wandering.

        `differences` has a list for each axis: differences with their variance (n,) at
        size 1.
        """
        square = np.append(0.0, SIZES) ** 2
        likelihood = np.zeros((3, len(square)))
        for of_axis, typical, score in zip(
            differences, self.typical, likelihood, strict=True
        ):
            for d, unit_variance in of_axis:
                score += d.scores(unit_variance, square * typical**2)
        at_zero, at_sizes = likelihood[:, 0], likelihood[:, 1:]
        other_axes_at_zero = at_zero.sum() - at_zero
        all_axes = at_sizes.sum(axis=0) + np.log(self.wander_chance * DENSITY)
        with np.errstate(divide="ignore"):  # a share of zero has the log -inf
            single_axis = (
                at_sizes
                + other_axes_at_zero[:, None]
                + np.log(self.wander_chance * self.single_axis_share * DENSITY)
            )
        no_axis = at_zero.sum() + np.log(1 - self.wander_chance)
        total = np.logaddexp.reduce([no_axis, *all_axes, *single_axis.ravel()])
        weight = np.exp(all_axes - total) + np.exp(single_axis - total)
        out = self.typical * np.sqrt(weight @ square[1:])
        any_axis = float(np.logaddexp.reduce([*all_axes, *single_axis.ravel()]))
        return np.where([bool(of_axis) for of_axis in differences], out, 0.0), any_axis


def _typical_walk(rows: Rows) -> tuple[Array, float]:
    """Typical random walk of each channel, (6,), SI per sqrt(s), and its probability.

    Both are those of the effect in the catalogue that is a random walk of all outputs.
    """
    (effect,) = (
        e
        for e in catalogue().values()
        if isinstance(e, Scatter) and len(e.params) == len(CHANNELS)
    )
    return np.array([p.typical for p in effect.params]), effect.chance(rows.x)


def _differences(rows: Rows, c: int, lag: int) -> Iterator[Differences]:
    """Differences of channel c at a lag, in rows; none if there are too few."""
    at = _later_half(rows, 2 * lag)
    y, sd, t = rows.y[:, c], rows.sd[:, c], rows.x.t
    used = rows.used[:, c]
    at = at[used[at] & used[at + lag] & used[at + 2 * lag]]
    if len(at) < detections.MIN_SAMPLES:
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
    """D of (3) for a = 1: two means x of their lengths apart."""
    return (_squared_ln(x + 1) + _squared_ln(x - 1)) / 2 - _squared_ln(x)  # (3)


def _squared_ln(x: Array) -> Array:
    """x^2 ln x; 0 at x = 0."""
    return x**2 * np.log(np.maximum(x, 1e-12))


def _later_half(rows: Rows, ahead: int) -> Index:
    """Rows in the later half of their window, with a row of it `ahead` rows later."""
    position = rows.x.position
    at = np.flatnonzero(position[ahead:] == position[:-ahead])
    first = np.searchsorted(position, position[at])
    count = np.searchsorted(position, position[at], side="right") - first
    return at[2 * (at - first) >= count - 1]
