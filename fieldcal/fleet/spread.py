"""How units of a lot differ, with the uncertainty of each taken off.

Most units are of the lot, a few may be odd:

    x_i ~ (1 - p) N(m, v_i) + p C(m, K v_i^1/2),   v_i = t^2 + s_i^2                (1)

with C that of Cauchy, since some are off by any number of spreads, and s_i the
uncertainty of the unit's own value. At each spread t the mean and p are found by
expectation and maximisation, with c_i the probability that a unit is none of the odd
ones, z_i = (x_i - m) / v_i^1/2 and w_i = c_i + (1 - c_i) 2 / (K^2 + z_i^2); then

    ln L(t) = sum_i ln density(x_i) - ln(sum_i w_i / v_i) / 2                       (2)

is largest at the spread (restricted maximum likelihood, which counts the mean), and its
interval is where (2) is less by up to 1.92. What is known of t^2 is, with W_k =
sum_i c_i / v_i^k,

    var t^2 = 2 / (W_2 - 2 W_3 / W_1 + W_2^2 / W_1^2)                               (3)

and what t may be is L(t) times the prior of Jeffreys, t W_2^1/2. Source: Harville, J.
Am. Stat. Assoc. 72 (1977) 320, with (3); Tiao and Tan, Biometrika 52 (1965) 37;
mixtures for outliers: Tukey's contaminated normal; weights of Cauchy: Lange, Little and
Taylor, J. Am. Stat. Assoc. 84 (1989) 881.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from fieldcal.core.chances import DEVIATION
from fieldcal.core.samples import Array

WIDER = 6.0
"""K: an odd unit is typically so many times as far off as others."""

CAUCHY = 0.5 * np.log(2 / np.pi)
"""Peak of Cauchy's density against that of the normal one, ln."""

ODD = 0.01
"""p before the units are seen, which counts as `COUNTS` units."""

COUNTS = 20.0

STEPS = 25
"""Of expectation and maximisation: the weights are settled long before."""

GRID = 160
"""Spreads that are tried."""

WITHIN = 1.92
"""ln of the likelihood by which the ends of a 95 % interval are less."""


@dataclass(frozen=True, slots=True)
class UnitSpread:
    """What most units are.

    Attributes
    ----------
    mean, mean_sigma : m with its standard uncertainty
    spread : t; what units differ by
    spread_sigma : its standard uncertainty by (3); nan where it is zero
    low, high : its 95 % interval
    square : t^2, averaged over every t that it may be
    odd : p, the part of units that are odd
    typical : (n,) c_i, probability that each unit is none of the odd ones
    sigma : (n,) what each unit is off by, its own uncertainty and that of the mean
        included

    """

    mean: float
    mean_sigma: float
    spread: float
    spread_sigma: float
    low: float
    high: float
    square: float
    odd: float
    typical: Array
    sigma: Array

    def chances(self, x: Array) -> Array:
        """Probability of values as far off as these, (n,); the spread is uncertain."""
        dof = max(float(self.typical.sum()) - 1.0, 1.0)
        out: Array = 2 * student.sf(np.abs(x - self.mean) / self.sigma, dof)
        return out


def spread(x: Array, sigma: Array) -> UnitSpread:
    """The spread of values (n,) whose uncertainties are (n,); n is two or more."""
    scale = DEVIATION * float(np.median(np.abs(x - np.median(x))))
    scale = scale or float(np.std(x)) or float(np.median(sigma))
    tried = np.concatenate([[0.0], np.geomspace(1e-2, 10.0, GRID) * scale])
    variance = tried[:, None] ** 2 + sigma**2
    middle, share = np.full(len(tried), np.median(x)), np.full(len(tried), ODD)
    for _ in range(STEPS):
        square = (x - middle[:, None]) ** 2 / variance
        core = np.log1p(-share)[:, None] - 0.5 * square
        odd = np.log(share / WIDER)[:, None] + CAUCHY - np.log1p(square / WIDER**2)
        typical = np.exp(core - np.logaddexp(core, odd))
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
    return UnitSpread(
        float(middle[best]),
        float(told[best] ** -0.5),
        float(tried[best]),
        _unsure(float(tried[best]), typical[best], variance[best]),
        float(inside.min()),
        float(inside.max()),
        float(weight @ tried**2 / weight.sum()),
        float(share[best]),
        typical[best],
        np.sqrt(variance[best] + 1 / told[best]),
    )


def _unsure(t: float, typical: Array, variance: Array) -> float:
    """Standard uncertainty of the spread, (3)."""
    if t == 0:
        return float("nan")
    one, two, three = ((typical / variance**k).sum() for k in (1, 2, 3))
    told = two - 2 * three / one + (two / one) ** 2
    return float(np.sqrt(2 / told) / (2 * t))
