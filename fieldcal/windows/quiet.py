"""Noise of a device at rest over 0.1 s to 12.8 s, by robust estimates.

    y_i                                    means of cells, i = 1 .. m
    u_k,i = mean of 2^k cells from cell i  running mean of level k
    a_k   = 1.4826 median |u_k,i+2^k - u_k,i| / sqrt(2)                           (1)
    a_k^2 = A / 2^k + B                    beyond the longest level measured     (2)
    s_k^2 = sum over j >= k of a_j^2 / 2                                         (3)

(1) is a robust Allan deviation. Few of the differences contain the edge of a step or a
push, so (1) measures the noise of the device in a disturbed window too. For the longest
levels a window has too few differences; (2) extrapolates with white noise and flicker.
(3) is the spread of u_k about the mean for any stationary noise (Haar analysis of
variance); for white noise s_k = a_k.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array
from fieldcal.windows.cells import CELL

LEVELS = 8
"""Durations: 0.1 s to 12.8 s, each twice the one before."""

KNEE = 0.05
"""Knee of the least flicker that is assumed, Hz: a short window does not show it."""

_MORE = 2.0
"""Largest factor by which noise may grow from one window to the next."""

LENGTH_RATIO = 16
"""Multiple of a duration that a window must last to measure the noise at it."""


@dataclass(frozen=True, slots=True)
class QuietNoise:
    """The noise of c channels at the levels that fit into a window.

    Attributes
    ----------
    allan : (levels, c) a_k, SI
    cells : m, including earlier windows

    """

    allan: Array
    cells: int

    @property
    def spread(self) -> Array:
        """Spread s_k of the running means about the mean, (levels, c), (3)."""
        halves = self.allan**2 / 2
        closed = np.vstack([halves, halves[-1:]])
        return np.sqrt(np.cumsum(closed[::-1], axis=0)[::-1][:-1])


def running_means(values: Array, levels: int = LEVELS) -> list[Array]:
    """Running means of `values` (m, c) over 2^k cells for each level k that fits."""
    sums = np.vstack([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    fit = [k for k in range(levels) if 2**k <= max(1, len(values) // 2)]
    return [(sums[2**k :] - sums[: -(2**k)]) / 2**k for k in fit]


def estimate_quiet_noise(
    means: Array, before: QuietNoise | None = None, levels: int = LEVELS
) -> QuietNoise:
    """Estimate the noise of cell means (m, c), no nan, m >= 2.

    It is pooled with `before`, the noise of earlier windows.
    """
    averaged = running_means(means, levels)
    measured: list[Array] = []
    for k, u in enumerate(averaged):
        if k and len(u) < LENGTH_RATIO * 2**k:
            break
        steps = np.abs(u[2**k :] - u[: -(2**k)])
        measured.append(MAD_TO_SIGMA * np.median(steps, axis=0) / np.sqrt(2))  # (1)
    known = np.array(measured)
    white, flat = _white_and_flat(known)
    tau = 2.0 ** np.arange(len(known), len(averaged))[:, None]
    own = QuietNoise(np.vstack([known, np.sqrt(white / tau + flat)]), len(means))  # (2)
    return own if before is None else _pool_noise(own, before)


def _pool_noise(own: QuietNoise, before: QuietNoise) -> QuietNoise:
    """Pool the noise of a window with that of earlier ones, which limits its growth."""
    common = min(len(own.allan), len(before.allan))
    known = before.allan[:common]
    new = np.where(
        known > 0, np.minimum(own.allan[:common], _MORE * known), own.allan[:common]
    )
    total = own.cells + before.cells
    pooled = np.sqrt((own.cells * new**2 + before.cells * known**2) / total)
    rest = (own if len(own.allan) > common else before).allan[common:]
    return QuietNoise(np.vstack([pooled, rest]), total)


def _white_and_flat(allan: Array) -> tuple[Array, Array]:
    """A and B >= 0 of (2) through the longer levels, each weighted by its number."""
    first = min(2, max(0, len(allan) - 2))
    variance = allan[first:] ** 2
    tau = 2.0 ** np.arange(first, len(allan))[:, None]
    largest = np.where(variance.max(axis=0) > 0, variance.max(axis=0), 1.0)
    weight = 1 / (tau * np.maximum(variance / largest, 1e-6) ** 2)
    weight = weight / weight.sum(axis=0)
    centre = (weight / tau).sum(axis=0)
    mean = (weight * variance).sum(axis=0)
    moment = (weight * (1 / tau - centre) ** 2).sum(axis=0)
    slope = (weight * (1 / tau - centre) * (variance - mean)).sum(axis=0)
    slope = slope / np.where(moment > 0, moment, np.inf)
    flat = np.where(moment > 0, np.clip(mean - slope * centre, 0.0, variance[-1]), 0.0)
    white = (variance[-1] - flat) * tau[-1]
    return white, np.maximum(flat, 2 * np.log(2) * KNEE * CELL * white)
