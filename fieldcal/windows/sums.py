"""Sums over the samples of each cell, for all cells of a stretch of samples at once.

    n = number of values x                 S = sum of x about an origin
    m = number of changes d between successive values      D = sum of d^2

Samples are (c, n) for c channels, and `first` is the index of the first sample of each
of the m cells. A nan is a missing value and enters no sum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array


def channel_sums(x: Array, step: Array, first: NDArray[np.int64], whole: bool) -> Array:
    """n, S, D, m of cells, (m, 4, 6), of samples and their changes, (6, n) each.

    `whole` says that no change, and therefore no sample, is missing.
    """
    if whole:
        return _sums_of_all(x, step, first)
    sums = np.zeros((len(first), 4, 6))
    for sensor in (slice(0, 3), slice(3, 6)):
        if np.isfinite(step[sensor]).all():
            sums[..., sensor] = _sums_of_all(x[sensor], step[sensor], first)
        elif np.isfinite(x[sensor]).any():
            sums[..., sensor] = _sums_of_known(x[sensor], step[sensor], first)
    return sums


def _sums_of_all(x: Array, step: Array, first: NDArray[np.int64]) -> Array:
    """n, S, D, m of cells, (m, 4, c), of c channels of which no value is missing."""
    sums = np.empty((len(first), 4, len(x)))
    sums[:, ::3] = np.diff(first, append=x.shape[1])[:, None, None]
    sums[:, 1] = np.add.reduceat(x, first, axis=1).T
    sums[:, 2] = np.add.reduceat(step**2, first, axis=1).T
    return sums


def _sums_of_known(x: Array, step: Array, first: NDArray[np.int64]) -> Array:
    """n, S, D, m of cells, (m, 4, c), of c channels, without missing values."""
    known, moved = np.isfinite(x), np.isfinite(step)
    squares = np.where(moved, step, 0.0) ** 2
    rows = np.vstack([known, np.where(known, x, 0.0), squares, moved])
    sums = np.add.reduceat(rows, first, axis=1).T
    return sums.reshape(-1, 4, len(x))


def smallest_changes(step: Array, first: NDArray[np.int64]) -> Array:
    """Smallest nonzero change in each cell, (m, 6), of changes (6, n)."""
    size = np.abs(step)
    changed = size > 0
    if not changed.all():
        size[~changed] = np.inf
    least: Array = np.minimum.reduceat(size, first, axis=1).T
    return least


def temperature_sums(temperature: Array, first: NDArray[np.int64]) -> Array:
    """Sum and number of the temperatures of cells, (m, 2)."""
    warm = np.isfinite(temperature)
    if not warm.any():
        return np.zeros((len(first), 2))
    rows = np.column_stack([np.where(warm, temperature, 0.0), warm])
    sums: Array = np.add.reduceat(rows, first, axis=0)
    return sums
