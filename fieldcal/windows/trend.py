"""A straight line through a window, robust against a disturbance of part of it."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

_PIECES = 12
"""Pieces of a window whose medians the line is laid through."""


def line(values: Array, step: Array | None = None) -> Array:
    """Robust straight line (m, c) through `values` (m, c): Theil 1950, of medians.

    `step` (c,) is what the values are rounded to; they are not where it is None.
    """
    m = len(values)
    step = np.zeros(values.shape[1]) if step is None else step
    if m < 2 * _PIECES:
        return np.broadcast_to(_median(values, step), values.shape)
    size = m // _PIECES
    cut = values[: size * _PIECES].reshape(_PIECES, size, -1)
    medians = np.array([_median(piece, step) for piece in cut])
    i, j = np.triu_indices(_PIECES, 1)
    slopes = (medians[j] - medians[i]) / ((j - i) * size)[:, None]
    tilt = np.arange(m)[:, None] * np.median(slopes, axis=0)
    laid: Array = tilt + _median(values - tilt, step)
    return laid


def _median(values: Array, step: Array) -> Array:
    """Median (c,) of rounded values (m, c), by how they lie within its step.

    The median itself is one of few values, and up to half a step off.
    """
    middle: Array = np.median(values, axis=0)
    half = step / 2
    inside = (np.abs(values - middle) <= half).sum(axis=0)
    below = (values < middle - half).sum(axis=0)
    share = (len(values) / 2 - below) / np.maximum(inside, 1)
    return middle + np.where(inside > 0, step * (share - 0.5), 0.0)
