"""The straight line through a window that a disturbance in part of it does not turn."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

_PIECES = 12
"""Pieces of a window whose medians the line is laid through."""


def line(values: Array) -> Array:
    """Robust straight line (m, c) through `values` (m, c): Theil 1950, of medians."""
    m = len(values)
    if m < 2 * _PIECES:
        return np.broadcast_to(np.median(values, axis=0), values.shape)
    size = m // _PIECES
    cut = values[: size * _PIECES].reshape(_PIECES, size, -1)
    medians = np.median(cut, axis=1)
    i, j = np.triu_indices(_PIECES, 1)
    slopes = (medians[j] - medians[i]) / ((j - i) * size)[:, None]
    tilt = np.arange(m)[:, None] * np.median(slopes, axis=0)
    laid: Array = tilt + np.median(values - tilt, axis=0)
    return laid
