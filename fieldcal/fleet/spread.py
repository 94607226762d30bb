"""Spread of the units of a lot, corrected for the uncertainty of each value.

Most units follow a normal distribution; a few may be odd:

    x_i ~ (1 - p) N(m, v_i) + p C(m, K v_i^1/2),   v_i = t^2 + s_i^2                (1)

with C the Cauchy distribution, because an odd unit may be off by any number of spreads,
and s_i the standard uncertainty of the unit's value. At each spread t, expectation
maximisation gives the mean m and p. c_i is the probability that a unit is not odd, z_i
= (x_i - m) / v_i^1/2 and w_i = c_i + (1 - c_i) 2 / (K^2 + z_i^2). Then

    ln L(t) = sum_i ln density(x_i) - ln(sum_i w_i / v_i) / 2                       (2)

is largest at the estimated spread (restricted maximum likelihood, which allows for the
estimated mean). The 95 % interval is where (2) is less by up to 1.92. With W_k = sum_i
c_i / v_i^k, the variance of t^2 is

    var t^2 = 2 / (W_2 - 2 W_3 / W_1 + W_2^2 / W_1^2)                               (3)

and the posterior of t is L(t) times the prior of Jeffreys, t W_2^1/2. Source: Harville,
J. Am. Stat. Assoc. 72 (1977) 320, with (3); Tiao and Tan, Biometrika 52 (1965) 37;
mixtures for outliers: Tukey's contaminated normal; weights of Cauchy: Lange, Little and
Taylor, J. Am. Stat. Assoc. 84 (1989) 881.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit, stdtr

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array

WIDER = 6.0
"""K: ratio of the typical deviation of an odd unit to that of others."""

CAUCHY = 0.5 * np.log(2 / np.pi)
"""ln of the ratio of the peaks of the Cauchy and the normal density."""

ODD = 0.01
"""Prior value of p; it has the weight of `COUNTS` units."""

COUNTS = 20.0

EM_STEPS = 25
"""Steps of expectation maximisation: the weights converge long before."""

GRID = 160
"""Number of spreads that are tried."""

WITHIN = 1.92
"""Drop of ln L at the ends of a 95 % interval."""


@dataclass(frozen=True, slots=True)
class UnitDistribution:
    """Distribution of a parameter over the units that are not odd.

    Attributes
    ----------
    mean, mean_sigma : m with its standard uncertainty
    spread : t, standard deviation of the units
    spread_sigma : standard uncertainty of the spread by (3); nan if the spread is zero
    low, high : 95 % interval of the spread
    mean_square_spread : t^2, averaged over the posterior of t
    odd_fraction : p, part of the units that are odd
    typical_probability : (n,) c_i, probability that each unit is not odd
    sigma : (n,) standard deviation of each value from the mean: spread, uncertainty of
        the value and uncertainty of the mean

    """

    mean: float
    mean_sigma: float
    spread: float
    spread_sigma: float
    low: float
    high: float
    mean_square_spread: float
    odd_fraction: float
    typical_probability: Array
    sigma: Array

    def tail_probabilities(self, x: Array) -> Array:
        """Probability of a deviation of this size or more, (n,), by Student's t."""
        dof = max(float(self.typical_probability.sum()) - 1.0, 1.0)
        out: Array = 2 * stdtr(dof, -np.abs(x - self.mean) / self.sigma)
        return out


def estimate_distribution(x: Array, sigma: Array) -> UnitDistribution:
    """Estimate mean and spread of values (n,) with uncertainties (n,); n >= 2."""
    scale = MAD_TO_SIGMA * float(np.median(np.abs(x - np.median(x))))
    scale = scale or float(np.std(x)) or float(np.median(sigma))
    tried = np.concatenate([[0.0], np.geomspace(1e-2, 10.0, GRID) * scale])
    variance = tried[:, None] ** 2 + sigma**2
    middle, share = np.full(len(tried), np.median(x)), np.full(len(tried), ODD)
    for _ in range(EM_STEPS):
        square = (x - middle[:, None]) ** 2 / variance
        core = np.log1p(-share)[:, None] - 0.5 * square
        odd = np.log(share / WIDER)[:, None] + CAUCHY - np.log1p(square / WIDER**2)
        typical = expit(core - odd)
        weight = typical + (1 - typical) * 2 / (WIDER**2 + square)
        weight /= variance
        middle = (weight * x).sum(axis=1) / weight.sum(axis=1)
        share = ((1 - typical).sum(axis=1) + COUNTS * ODD) / (len(x) + COUNTS)
    density = np.logaddexp(core, odd) - 0.5 * np.log(variance)
    told = weight.sum(axis=1)
    likely = density.sum(axis=1) - 0.5 * np.log(told)  # (2)
    best = int(np.argmax(likely))
    inside = tried[likely > likely[best] - WITHIN]
    weight = np.exp(likely - likely[best]) * np.gradient(tried)
    weight *= tried * np.sqrt((typical / variance**2).sum(axis=1))
    return UnitDistribution(
        float(middle[best]),
        float(told[best] ** -0.5),
        float(tried[best]),
        _spread_sigma(float(tried[best]), typical[best], variance[best]),
        float(inside.min()),
        float(inside.max()),
        float(weight @ tried**2 / weight.sum()),
        float(share[best]),
        typical[best],
        np.sqrt(variance[best] + 1 / told[best]),
    )


def _spread_sigma(t: float, typical: Array, variance: Array) -> float:
    """Standard uncertainty of the spread t, (3)."""
    if t == 0:
        return float("nan")
    one, two, three = ((typical / variance**k).sum() for k in (1, 2, 3))
    told = two - 2 * three / one + (two / one) ** 2
    return float(np.sqrt(2 / told) / (2 * t))
