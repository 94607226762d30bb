"""Control charts of units in the order in which they were measured.

With z_i a unit's value less the mean of its lot in its own standard deviations,

    e_i = (1 - r) e_(i-1) + r z_i,   |e_i| < L (r / (2 - r) (1 - (1 - r)^2i))^1/2   (1)
    c_i = max(0, c_(i-1) + z_i - k),   and likewise of -z_i,   c_i < h              (2)

L and h are in `chart_limits`. z is clipped at `CUT`, so that a single odd unit does not
count as a shift. If the second half of a lot is shifted, the first half lies off the
mean as well and may pass a limit first. So the unit at which the mean changes is not
where a chart begins to rise, but behind the largest of all sums of z from the first
unit on (the most probable place of a single step).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array

WEIGHT = 0.1
"""r: with a memory of about twenty units, a shift of half a spread is found soonest."""

SLACK = 0.25
"""k: half of the shift that is to be found soonest; that shift is half a spread."""

CUT = 3.0
"""Standard deviations at which z is clipped."""


@dataclass(frozen=True, slots=True)
class ControlChart:
    """A control chart with its limits.

    Attributes
    ----------
    name : "EWMA" or "CUSUM"
    values : (n,) e_i, or the larger of both sides' c_i with the sign of its side
    limit : (n,) bound on the absolute value
    alarm : number of the first unit beyond the limit; None if there is none
    onset : number of the first unit after the change of the mean; None without an alarm

    """

    name: str
    values: Array
    limit: Array
    alarm: int | None
    onset: int | None


def ewma_sigma(units: int) -> Array:
    """Standard deviation of e_i in a lot in control, (units,)."""
    number = np.arange(1, units + 1)
    out: Array = np.sqrt(WEIGHT / (2 - WEIGHT) * (1 - (1 - WEIGHT) ** (2 * number)))
    return out


def ewma(z: Array, bound: float) -> ControlChart:
    """EWMA chart (1) of standardised values (n,); `bound` is L."""
    z = np.clip(z, -CUT, CUT)
    values, at = np.zeros(len(z)), 0.0
    for i, one in enumerate(z):
        at = (1 - WEIGHT) * at + WEIGHT * one
        values[i] = at
    return _chart("EWMA", z, values, bound * ewma_sigma(len(z)))


def cusum(z: Array, bound: float) -> ControlChart:
    """CUSUM chart (2) of standardised values (n,); `bound` is h."""
    z = np.clip(z, -CUT, CUT)
    up, down, values = 0.0, 0.0, np.zeros(len(z))
    for i, one in enumerate(z):
        up, down = max(0.0, up + one - SLACK), max(0.0, down - one - SLACK)
        values[i] = up if up >= down else -down
    return _chart("CUSUM", z, values, np.full(len(z), bound))


def _chart(name: str, z: Array, values: Array, limit: Array) -> ControlChart:
    beyond = np.abs(values) > limit
    if not beyond.any():
        return ControlChart(name, values, limit, None, None)
    return ControlChart(name, values, limit, int(np.argmax(beyond)), _step(z))


def _step(z: Array) -> int:
    """Number of the first unit after the most probable single step of the mean."""
    sums = np.cumsum(z - z.mean())[:-1]
    return int(np.argmax(np.abs(sums))) + 1 if len(sums) else 0
