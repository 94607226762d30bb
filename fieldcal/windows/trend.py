"""Straight lines through a window, robust against a disturbance of part of it.

A device that warms up drifts along a straight line for a minute or two. Over a longer
window the drift is a curve: there each section has a line of its own.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

_PIECES = 12
"""Number of pieces of a section; the line is fitted to their medians."""

SECTION = 1200
"""Largest number of cells in a section: two minutes. Over that time, the bias of a
device that settles within minutes departs from a straight line by a few hundredths of
its drift."""


def robust_lines(values: Array, step: Array | None = None) -> Array:
    """Robust straight lines (m, c) through equal sections of `values` (m, c).

    `step` (c,) is the step to which values are rounded; None if they are not.
    """
    step = np.zeros(values.shape[1]) if step is None else step
    sections = np.array_split(values, max(1, -(-len(values) // SECTION)))
    return np.concatenate([_robust_line(section, step) for section in sections])


def drift_course(values: Array, lines: Array) -> Array:
    """Drift (m, c) of `values` (m, c), given the robust lines `lines` through them.

    Two neighbouring means cannot distinguish a drift from a step. In each section the
    one with the smaller residual is used: the line, or two means before and after the
    best instant. The course has no step between sections.
    """
    rates = []
    sections = max(1, -(-len(values) // SECTION))
    for part, line in zip(
        np.array_split(values, sections), np.array_split(lines, sections), strict=True
    ):
        drifts = ((part - line) ** 2).sum(axis=0) < _squares_beside_step(part)
        rate = np.where(drifts, line[-1] - line[0], 0.0) / max(1, len(line) - 1)
        rates.append(np.broadcast_to(rate, part.shape))
    course: Array = np.cumsum(np.concatenate(rates), axis=0)
    return course


def _squares_beside_step(values: Array) -> Array:
    """Least sum of squares (c,) about two means, before and after some instant."""
    about = values - values.mean(axis=0)
    m, total = len(values), np.cumsum(about, axis=0)[:-1]
    first = np.arange(1, m)[:, None]
    between = total**2 * m / (first * (m - first))
    left: Array = (about**2).sum(axis=0) - between.max(axis=0, initial=0.0)
    return left


def _robust_line(values: Array, step: Array) -> Array:
    """Straight line (m, c) through `values` (m, c), by medians (Theil 1950)."""
    m = len(values)
    if m < 2 * _PIECES:
        return np.broadcast_to(_median(values, step), values.shape)
    size = m // _PIECES
    cut = values[: size * _PIECES].reshape(_PIECES, size, -1)
    medians = _median(cut, step)
    i, j = np.triu_indices(_PIECES, 1)
    slopes = (medians[j] - medians[i]) / ((j - i) * size)[:, None]
    tilt = np.arange(m)[:, None] * np.median(slopes, axis=0)
    lines: Array = tilt + _median(values - tilt, step)
    return lines


def _median(values: Array, step: Array) -> Array:
    """Median (..., c) of rounded values (..., m, c), interpolated within its step.

    The plain median is one of few values, and up to half a step off.
    """
    middle: Array = np.median(values, axis=-2)
    centre, half = middle[..., None, :], step / 2
    inside = (np.abs(values - centre) <= half).sum(axis=-2)
    below = (values < centre - half).sum(axis=-2)
    share = (values.shape[-2] / 2 - below) / np.maximum(inside, 1)
    return middle + np.where(inside > 0, step * (share - 0.5), 0.0)
