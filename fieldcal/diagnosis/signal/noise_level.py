"""The level of the noise in a power spectrum, from the median of neighbours.

Drift and settling make a slope, out of which a line must stand as well.
Source: D. Percival, A. Walden, Spectral Analysis for Physical Applications, chapter 10.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import detections
from fieldcal.physics.recording import medians


def noise_level(power: Array, count: int, known: Array | None = None) -> Array:
    """Mean power of noise at each frequency, (m,), of the sum of some periodograms.

    `known` (m,) is its level away from slopes; otherwise a running median gives it.
    """
    if known is None:
        # median of Gamma(W) over its mean, by Wilson and Hilferty
        known = _median_floor(power) / (1 - 1 / (9 * count)) ** 3
    return _floor_on_slope(power, known)


def _median_floor(power: Array) -> Array:
    """Running median (m,) of the power, interpolated between stretches."""
    parts = max(1, len(power) // (2 * detections.FLOOR_NEIGHBOURS))
    each = len(power) // parts
    level = medians(power[: parts * each].reshape(parts, each))
    middle = (np.arange(parts) + 0.5) * each
    floor: Array = np.interp(np.arange(len(power)), middle, level)
    return np.maximum(floor, 1e-300)


def _floor_on_slope(power: Array, floor: Array) -> Array:
    """The floor, raised to the power close by where that is far above it.

    Drift and settling have more power at lower frequencies. A line must stand out of
    that slope, too.
    """
    n = len(power)
    # sums up to and including each; beyond the ends there is nothing to add
    totals = np.pad(
        np.cumsum(power),
        (detections.FURTHEST_NEIGHBOUR + 1, detections.FURTHEST_NEIGHBOUR + 1),
        "edge",
    )
    totals[: detections.FURTHEST_NEIGHBOUR + 1] = 0.0
    counts = np.pad(
        np.arange(n + 1),
        (detections.FURTHEST_NEIGHBOUR, detections.FURTHEST_NEIGHBOUR + 1),
        "edge",
    )
    sides = []
    for low, high in (
        (-detections.FURTHEST_NEIGHBOUR, -detections.NEAREST_NEIGHBOUR),
        (detections.NEAREST_NEIGHBOUR + 1, detections.FURTHEST_NEIGHBOUR + 1),
    ):
        first, last = (
            detections.FURTHEST_NEIGHBOUR + low,
            detections.FURTHEST_NEIGHBOUR + high,
        )
        count = counts[last : last + n] - counts[first : first + n]
        mean = (totals[last : last + n] - totals[first : first + n]) / np.maximum(
            count, 1
        )
        sides.append(np.where(count > 0, mean, np.inf))
    below, above = sides
    # at either end of the spectrum only one side has neighbours
    beside = np.where(np.isfinite(above), np.maximum(below, above), below)
    beside = np.where(np.isfinite(below), beside, above)
    falls = (beside > detections.STEEP_RATIO * floor) & (
        below > detections.SLOPE_POWER_SHARE * power
    )
    return np.where(falls, np.minimum(beside, power), floor)
