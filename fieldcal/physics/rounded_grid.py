"""The grid of a device whose values a log of few digits rounded once more.

    v = u round(k q / u)                                                           (1)

k are whole numbers, q is the step of the device and u < q that of the digits. All
values lie on the grid of u, and next to each other they are a varying number of u
apart. A step q explains n different values if each is within u / 2 of its multiples. By
chance it does with probability (u / q)^n.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

TRIED_AT_ONCE, MOST_TRIED, PROBES = 1 << 14, 1 << 20, 24
"""Steps that are tried together, and at all; and values by which they are."""

LONGEST_RUN = 32
"""Neighbouring values that bound the step from above: m of them by about u / m."""

CHANCE = 1e-9
"""Probability of the values below which a step is no matter of chance."""

ROUNDED = 0.55
"""Largest departure from a multiple of the step, in u: a half, and what conversions of
units add."""


def grid_below_digits(shown: Array, digits: float) -> float:
    """Step q of (1); 0 if there is none.

    Parameters
    ----------
    shown : (n,) different values, in order
    digits : u

    >>> log = np.unique(np.round(np.arange(-90, 900) / 2048, 4))
    >>> abs(2048 * grid_below_digits(log, 1e-4) - 1) < 1e-3
    True
    >>> grid_below_digits(np.arange(50) * 1e-4, 1e-4)
    0.0
    """
    largest = float(np.abs(shown).max(initial=0.0))
    if not digits or len(shown) < 2 or not largest:
        return 0.0
    runs = range(1, min(LONGEST_RUN, len(shown)))
    apart = [float((shown[m:] - shown[:-m]).min()) for m in runs]
    # so far apart are m + 1 values in a row, but for the rounding of both ends
    high = min((a + 2 * ROUNDED * digits) / m for m, a in zip(runs, apart, strict=True))
    low = max(apart[0] - digits, digits)
    change = digits * low / (4 * largest)
    many = max(int(np.ceil((high - low) / change)), 0)
    if many > MOST_TRIED:
        return 0.0
    few = shown[np.unique(np.linspace(0, len(shown) - 1, PROBES).astype(np.intp))]
    # of steps that explain all values, the widest does so least by chance
    for first in range(0, many, TRIED_AT_ONCE):
        tried = high - change * np.arange(first, min(first + TRIED_AT_ONCE, many))
        chance = len(shown) * np.log(1.5 * digits / tried) + np.log(many)
        tried = tried[chance < np.log(CHANCE)]
        place = few / tried[:, None]
        off = np.abs(place - np.round(place)).max(axis=1) * tried
        for step in tried[off < 0.8 * digits]:
            k = np.round(shown / step)
            step = float(k @ shown / (k @ k))
            if np.abs(shown - step * k).max() <= ROUNDED * digits:
                return step
    return 0.0
