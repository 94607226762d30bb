"""Straight lines through a window, robust against a disturbance of part of it.

A device that warms up drifts along a straight line for a minute or two. Over a longer
window the drift is a curve: there each section has a line of its own.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

_PIECES = 12
"""Pieces of a window whose medians the line is laid through."""


SECTION = 1200
"""Cells of a section at most: two minutes, in which a device that settles within
minutes is a few hundredths of its drift from a straight line."""


def lines(values: Array, step: Array | None = None) -> Array:
    """Robust straight lines (m, c) through equal sections of `values` (m, c).

    `step` (c,) is what the values are rounded to; they are not where it is None.
    """
    step = np.zeros(values.shape[1]) if step is None else step
    sections = np.array_split(values, max(1, -(-len(values) // SECTION)))
    return np.concatenate([_line(section, step) for section in sections])


def drift(values: Array, laid: Array) -> Array:
    """What drifts, (m, c), of `values` (m, c) with the lines `laid` through them.

    A drift and a step look alike to two means side by side. In each section the one
    counts of which less remains: the line, or the two means before and after the
    instant that parts them best. The course has no step where sections meet.
    """
    rates = []
    sections = max(1, -(-len(values) // SECTION))
    for part, line in zip(
        np.array_split(values, sections), np.array_split(laid, sections), strict=True
    ):
        drifts = ((part - line) ** 2).sum(axis=0) < _beside_a_step(part)
        rate = np.where(drifts, line[-1] - line[0], 0.0) / max(1, len(line) - 1)
        rates.append(np.broadcast_to(rate, part.shape))
    course: Array = np.cumsum(np.concatenate(rates), axis=0)
    return course


def _beside_a_step(values: Array) -> Array:
    """Sum of squares (c,) about the two means that leave the least of it."""
    about = values - values.mean(axis=0)
    m, total = len(values), np.cumsum(about, axis=0)[:-1]
    first = np.arange(1, m)[:, None]
    between = total**2 * m / (first * (m - first))
    left: Array = (about**2).sum(axis=0) - between.max(axis=0, initial=0.0)
    return left


def _line(values: Array, step: Array) -> Array:
    """A straight line (m, c) through `values` (m, c): Theil 1950, of medians."""
    m = len(values)
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
