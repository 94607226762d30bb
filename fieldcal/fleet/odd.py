"""Units out of family at a stated false-discovery rate.

A unit's p-value is the smallest of its parameters, times the number of its parameters.
With the p-values of n units in ascending order, the units up to the last i with

    p_(i) <= q i / n                                                                (1)

are odd at the false-discovery rate q (Benjamini and Hochberg, J. R. Stat. Soc. B 57,
1995, 289).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array


def unit_p_values(chances: Array) -> Array:
    """p-value of each unit, (n,), from those of its parameters, (n, k), nan if absent.

    >>> unit_p_values(np.array([[0.5, 0.001], [0.02, np.nan]]))
    array([0.002, 0.02 ])
    """
    count = np.isfinite(chances).sum(axis=1)
    least = np.where(np.isfinite(chances), chances, 1.0).min(axis=1)
    out: Array = np.minimum(1.0, np.maximum(count, 1) * least)
    return out


def benjamini_hochberg(chances: Array, rate: float) -> NDArray[np.bool_]:
    """Whether each unit is odd at a false-discovery rate, (n,), (1).

    >>> benjamini_hochberg(np.array([0.001, 0.9, 0.02, 0.04, 0.2]), 0.05)
    array([ True, False,  True, False, False])
    """
    order = np.argsort(chances)
    below = chances[order] <= rate * np.arange(1, len(chances) + 1) / len(chances)
    out = np.zeros(len(chances), dtype=bool)
    if below.any():
        out[order[: int(np.flatnonzero(below)[-1]) + 1]] = True
    return out
