"""Times that several rows share: a clock too coarse, or when a batch of them came."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.units.scales import MIN_ROWS
from fieldcal.importing.units.time_units import RATES_HZ, TIME_SIZES

SHARED, TOGETHER, REGULAR = 0.5, 0.1, 0.9
"""Part of the rows that come with the row before, of a clock too coarse; the part of
the mean step by which they follow; and of batches that have as many rows."""

COARSE = 0.01
"""Part of the rows that have the time of the row before, of a clock that is too coarse
or that tells when several rows came."""

JITTER = 0.5
"""Quartiles of the steps of a sensor's clock differ by a smaller part of the step;
those of arrivals, of rows that wait for each other, by more."""


class SharedTimes(NamedTuple):
    """Sharing of times among rows.

    Attributes
    ----------
    step : from those of one batch to those of the next, in their unit
    rows : in a batch
    even : whether all batches have as many, but for one row
    equal : whether they have the very same time; else they may be bursts of a device
        that pauses between them

    """

    step: float
    rows: float
    even: bool
    equal: bool


def shared_times(t: Array) -> SharedTimes | None:
    """How rows share times (n,): a coarse clock, or when a batch of them came.

    None where most rows have a time of their own.
    """
    t = t[np.isfinite(t)]
    steps = np.diff(t)
    if len(steps) < MIN_ROWS:
        return None
    together = steps < TOGETHER * steps.mean()
    begins = np.flatnonzero(~together)
    if together.mean() < SHARED or len(begins) < len("12"):
        return None
    rows, usual = np.diff(begins), float(np.median(np.diff(begins)))
    even = float((np.abs(rows - usual) <= 1).mean()) >= REGULAR
    equal = float((steps == 0).mean()) > SHARED
    return SharedTimes(float(np.median(np.diff(t[begins + 1]))), usual, even, equal)


def coarse_tick(t: Array) -> float:
    """Step of a clock with times (n,) that some rows share; 0 of another.

    >>> coarse_tick(np.floor(np.arange(100) / 1.3)), coarse_tick(np.arange(100.0))
    (1.0, 0.0)
    """
    steps = np.diff(t[np.isfinite(t)])
    if len(steps) < MIN_ROWS or not COARSE <= float((steps == 0).mean()) < SHARED:
        return 0.0
    return float(np.quantile(steps[steps > 0], COARSE))


def time_units_of_bursts(t: Array) -> list[str]:
    """Units in which rows of times (n,) between pauses were taken when these say.

    They are even then, and make the rate of a log. Of rows that a port hands over at
    once, each with the time at which it was read, they are neither.
    """
    steps = np.diff(t[np.isfinite(t)])
    own = steps[steps < TOGETHER * steps.mean()]
    low, middle, high = np.quantile(own, (0.25, 0.5, 0.75))
    if middle <= 0 or high - low > JITTER * middle:
        return []
    least, most = RATES_HZ
    return [
        u for u, n in TIME_SIZES.items() if u != "d" and least <= n / middle <= most
    ]
