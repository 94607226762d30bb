"""Units that the times of a file may be in.

A logger writes 1 to 8000 samples a second, which tells s, ms, us and ns apart.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.scales import FEWEST

RATES_HZ = (1.0, 8000.0)
"""What a logger of an IMU writes in a second."""

SHORTEST = 5.0
"""Shortest recording, s, where another unit of time makes it longer."""

TIME_SIZES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}

UNIX = (1e9, 4e9)
"""Times of day since 1970, s: 2001 to 2096."""


def time_units(t: Array) -> list[str]:
    """Units that times (n,) of a file may be in."""
    t = t[np.isfinite(t)]
    steps = np.diff(t)
    steps = steps[steps > 0]
    if len(steps) < FEWEST:
        return []
    day = [u for u, n in TIME_SIZES.items() if UNIX[0] <= t[-1] / n < UNIX[1]]
    step = float(np.median(steps))
    low, high = RATES_HZ
    usual = [u for u, n in TIME_SIZES.items() if low <= n / step <= high]
    if both := [u for u in usual if u in day]:
        return both
    span = float(steps.sum())
    return [u for u in usual if span / TIME_SIZES[u] >= SHORTEST] or usual
