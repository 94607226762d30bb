"""Decay of the accelerometers toward zero at rest, as behind a high-pass filter.

At rest the force is constant, so that a high-pass of first order leaves of the means of
an output over two parts of a window, d seconds apart,

    m_2 = m_1 exp(-d / tau)                                                          (1)

for every axis and window with one tau. Nothing else does: what settles or creeps ends
at the force, not at zero.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array, Block

PARTS = 8
"""Parts of a window whose means are compared."""

MIN_SAMPLES = 8 * PARTS
"""Least samples of a window, so that its means are those of noise."""

MIN_SURE = 100.0
"""Least ratio of the squares that (1) explains to those that it leaves."""

MAX_KEPT = 0.9
"""Most that a window keeps of its first value: behind a slower filter it can be used,
and what is lost is a cause of the model."""

STEPS = 6
"""Gauss-Newton steps from the slope at once to that of an exponential."""


def decay_time_constant(
    block: Block, windows: Sequence[tuple[float, float] | None]
) -> float | None:
    """Time constant tau by which accelerometers forget the force at rest, s.

    None if they do not, or keep most of it for a window.

    >>> t = np.arange(0.0, 60.0, 0.02)
    >>> acc = np.outer(np.exp(-t / 25.0), [9.0, -3.0, 2.0])
    >>> round(decay_time_constant(Block.of(t, acc), [(0.0, 30.0), (30.0, 60.0)]))
    25
    """
    pairs = [_pairs(block, window) for window in windows if window is not None]
    first, second, apart = (
        np.concatenate([np.empty(0), *some]) for some in zip(*pairs, strict=True)
    ) if pairs else (np.empty(0),) * 3  # fmt: skip
    if len(first) < 2 * PARTS:
        return None
    rate = 0.0
    for _ in range(STEPS):
        kept = np.exp(-rate * apart)
        slope = -apart * first * kept
        rate += float(slope @ (second - first * kept) / max(slope @ slope, 1e-300))
        rate = float(np.clip(rate, 0.0, 2.0 / np.median(apart)))
    left = second - first * np.exp(-rate * apart)  # (1)
    explained = first - first * np.exp(-rate * apart)
    if not explained @ explained > MIN_SURE * (left @ left):
        return None
    longest = PARTS * float(apart.max())
    return 1 / rate if np.exp(-rate * longest) < MAX_KEPT else None


def _pairs(block: Block, window: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Means of neighbouring parts of a window, (k,) each, and s between them.

    Axes of which either is unknown are left out.
    """
    acc = block.between(*window).acc
    if len(acc) < MIN_SAMPLES:
        return np.empty(0), np.empty(0), np.empty(0)
    rows = len(acc) // PARTS * PARTS
    means = acc[:rows].reshape(PARTS, -1, 3).mean(axis=1)
    first, second = means[:-1].ravel(), means[1:].ravel()
    known = np.isfinite(first + second)
    apart = np.full(int(known.sum()), (window[1] - window[0]) / PARTS)
    return first[known], second[known], apart
