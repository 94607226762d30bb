"""Control charts of units in the order in which they were measured.

With z_i a unit's value less the mean of its lot in its own standard deviations,

    e_i = (1 - r) e_(i-1) + r z_i,   |e_i| < L (r / (2 - r) (1 - (1 - r)^2i))^1/2   (1)
    c_i = max(0, c_(i-1) + z_i - k),   and likewise of -z_i,   c_i < h              (2)

L and h are set by the average number of units to a false alarm: for (1) by the Markov
chain of Brook and Evans (Biometrika 59, 1972), for (2) by Siegmund's formula,

    N = (exp(2 k b) - 2 k b - 1) / (4 k^2),   b = h + 1.166                         (3)

for both sides together. z is clipped at `CUT`, so that a single odd unit does not count
as a shift.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fieldcal.core.samples import Array

WEIGHT = 0.1
"""r: with a memory of about twenty units, a shift of half a spread is found soonest."""

SLACK = 0.25
"""k: half of the shift that is to be found soonest; that shift is half a spread."""

CUT = 3.0
"""Standard deviations at which z is clipped."""

STATES = 101
"""Number of states of the Markov chain."""


@dataclass(frozen=True, slots=True)
class ControlChart:
    """A control chart with its limits.

    Attributes
    ----------
    name : "EWMA" or "CUSUM"
    values : (n,) e_i, or the larger of both sides' c_i with the sign of its side
    limit : (n,) bound on the absolute value
    alarm : number of the first unit beyond the limit; None if there is none
    onset : number of the unit at which the shift began, CUSUM only; None if unknown

    """

    name: str
    values: Array
    limit: Array
    alarm: int | None
    onset: int | None = None


def ewma(z: Array, units: float) -> ControlChart:
    """EWMA chart (1) of standardised values (n,).

    `units` is the average number of units to a false alarm.
    """
    z = np.clip(z, -CUT, CUT)
    values, at = np.zeros(len(z)), 0.0
    for i, one in enumerate(z):
        at = (1 - WEIGHT) * at + WEIGHT * one
        values[i] = at
    number = np.arange(1, len(z) + 1)
    wide = WEIGHT / (2 - WEIGHT) * (1 - (1 - WEIGHT) ** (2 * number))
    limit = ewma_limit(units, WEIGHT) * np.sqrt(wide)
    return ControlChart("EWMA", values, limit, _first_index(np.abs(values) > limit))


def cusum(z: Array, units: float) -> ControlChart:
    """CUSUM chart (2) of standardised values (n,); `units` as for `ewma`."""
    z = np.clip(z, -CUT, CUT)
    up, down, began_up, began_down = 0.0, 0.0, 0, 0
    values, begins = np.zeros(len(z)), np.zeros(len(z), dtype=int)
    for i, one in enumerate(z):
        up, down = max(0.0, up + one - SLACK), max(0.0, down - one - SLACK)
        began_up = began_up if up else i + 1
        began_down = began_down if down else i + 1
        values[i] = up if up >= down else -down
        begins[i] = began_up if up >= down else began_down
    limit = np.full(len(z), cusum_limit(units))
    alarm = _first_index(np.abs(values) > limit)
    onset = None if alarm is None else int(begins[alarm])
    return ControlChart("CUSUM", values, limit, alarm, onset)


def _first_index(beyond: NDArray[np.bool_]) -> int | None:
    return int(np.argmax(beyond)) if beyond.any() else None


def cusum_limit(units: float, slack: float = SLACK) -> float:
    """Limit h of (3) for an average of `units` units to a false alarm.

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
    """Limit L of (1) for an average of `units` units to a false alarm.

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
