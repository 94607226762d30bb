"""Limits of control charts for a stated chance of a false alarm.

A chart shows a lot about the lot's own mean, so its values add up to nearly zero and
stray less than those about a known mean. Limits for a known mean would almost never be
passed by a lot of some hundred units, whether it drifts or not. For lots of up to
`SIMULATED` units both limits are therefore quantiles of simulated lots in control,
where a unit's deviation from the mean of n units, after i - 1 others with the sum S, is

    z_i ~ N(-S / (n - i + 1), (n - i) / (n - i + 1))                                (1)

Beyond the last hundredth of the lots, the excess of the CUSUM, and of the square of the
EWMA in its standard deviations, falls off exponentially. For larger lots the mean is as
good as known, and the average number of units to a false alarm gives the limits: for
EWMA by the Markov chain of Brook and Evans (Biometrika 59, 1972), for CUSUM by
Siegmund's formula for both sides together,

    N = (exp(2 k b) - 2 k b - 1) / (4 k^2),   b = h + 1.166                         (2)
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import ndtr

from fieldcal.core.samples import Array
from fieldcal.fleet.control import CUT, SLACK, WEIGHT, ewma_sigma

SIMULATED = 2000
"""Largest lot whose limits are simulated; more than ten memories of either chart."""

LOTS = 20_000
"""Number of simulated lots."""

TAIL = 0.01
"""Part of the simulated lots from which rarer ones are extrapolated."""

STATES = 101
"""Number of states of the Markov chain."""


def chart_limits(units: int, untimed: int, chance: float) -> tuple[float, float]:
    """Limits of EWMA, in standard deviations, and of CUSUM.

    Parameters
    ----------
    units : number of units that give mean and spread
    untimed : number of those that are in no chart, as their time is unknown
    chance : of a false alarm of one chart over the whole lot

    """
    charted = units - untimed
    if units > SIMULATED:
        quiet = charted / chance
        return ewma_limit(quiet, WEIGHT), cusum_limit(quiet)
    square, total = _largest_in_control(units, untimed)
    return _rare(square, chance) ** 0.5, _rare(total, chance)


def _rare(largest: Array, chance: float) -> float:
    """Value that a share `chance` of the simulated lots passes."""
    if chance >= TAIL:
        return float(np.quantile(largest, 1 - chance))
    begin = float(np.quantile(largest, 1 - TAIL))
    excess = float((largest[largest > begin] - begin).mean())
    return begin + excess * float(np.log(TAIL / chance))


@cache
def _largest_in_control(units: int, untimed: int) -> tuple[Array, Array]:
    """Largest square of EWMA in its standard deviations, and largest CUSUM, of lots."""
    rng = np.random.default_rng([units, untimed])

    def normal() -> Array:
        drawn: Array = rng.standard_normal(LOTS, dtype=np.float32)
        return drawn

    total = normal() * np.float32((untimed * (1 - untimed / units)) ** 0.5)
    at: Array = np.zeros(LOTS, np.float32)
    up, down, square, sums = (at.copy() for _ in range(4))
    for i, sigma in enumerate(ewma_sigma(units - untimed).tolist()):
        left = units - untimed - i
        off = normal() * np.float32(((left - 1) / left) ** 0.5) - total / left  # (1)
        total += off
        z: Array = np.clip(off, -CUT, CUT)
        at = np.float32(1 - WEIGHT) * at + np.float32(WEIGHT) * z
        up = np.maximum(up + z - np.float32(SLACK), 0)
        down = np.maximum(down - z - np.float32(SLACK), 0)
        np.maximum(square, (at / np.float32(sigma)) ** 2, out=square)
        np.maximum(sums, np.maximum(up, down), out=sums)
    return square.astype(float), sums.astype(float)


def cusum_limit(units: float, slack: float = SLACK) -> float:
    """Limit h of (2) for an average of `units` units to a false alarm.

    >>> round(cusum_limit(465, 0.5), 1)
    5.0
    """
    from scipy.optimize import brentq

    def over(h: float) -> float:
        b = 2 * slack * (h + 1.166)
        return float(np.expm1(b) - b) / (4 * slack**2) - units

    return float(brentq(over, -1.0, 400.0))


@cache
def ewma_limit(units: float, weight: float) -> float:
    """Limit L of EWMA for an average of `units` units to a false alarm.

    >>> round(ewma_limit(500.0, 0.2), 2), round(ewma_limit(500.0, 0.1), 2)
    (2.96, 2.82)
    """
    from scipy.optimize import brentq

    def over(bound: float) -> float:
        return float(np.log(_average_run_length(bound, weight) / units))

    return float(brentq(over, 0.5, 7.0, xtol=1e-4))


def _average_run_length(bound: float, weight: float) -> float:
    """Average number of units until a chart without a shift passes its limit."""
    high = bound * np.sqrt(weight / (2 - weight))
    step = 2 * high / STATES
    at = -high + step * (np.arange(STATES) + 0.5)
    edge = (at[None, :] - (1 - weight) * at[:, None]) / weight
    half = step / (2 * weight)
    stays = ndtr(edge + half) - ndtr(edge - half)
    left = np.linalg.solve(np.eye(STATES) - stays, np.ones(STATES))
    return float(left[STATES // 2])
