"""Channels of a recording at even instants, high-passed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from fieldcal.core.samples import ACC, GYR, Array, Block

TRIADS = (ACC, GYR)

GRID_HZ = 25.0
"""Samples a second that are correlated: bodies move more slowly than half of it."""

SLOW_S = 8.0
"""Slower changes are removed, s, and biases with them."""

GAP_STEPS = 4.0
"""Shortest gap, in steps of the grid."""


@dataclass(frozen=True, slots=True)
class EvenGrid:
    """Channels at even instants.

    Attributes
    ----------
    start : first instant, s
    six : (n, 6) high-passed; 0 where there are no samples
    mean : (6,) of the channels before the high-pass
    has_samples : (n,) whether there were samples

    """

    start: float
    six: Array
    mean: Array
    has_samples: Array

    @classmethod
    def of(cls, block: Block) -> EvenGrid:
        """Resample a block at even instants."""
        t = np.arange(block.t[0], block.t[-1], 1 / GRID_HZ)
        out, mean = np.zeros((len(t), 6)), np.zeros(6)
        for c, values in enumerate(block.six.T):
            known = np.isfinite(values)
            if known.sum() < 2:
                continue
            even = _resampled(block.t[known], values[known], t)
            mean[c] = even.mean()
            out[:, c] = even - uniform_filter1d(even, int(SLOW_S * GRID_HZ))
        after = np.clip(np.searchsorted(block.t, t), 1, len(block.t) - 1)
        there = block.t[after] - block.t[after - 1] < GAP_STEPS / GRID_HZ
        return cls(float(t[0]), out * there[:, None], mean, there.astype(float))

    def __len__(self) -> int:
        """Number of instants."""
        return len(self.six)

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Channels that show any motion, (6,)."""
        moving: NDArray[np.bool_] = np.any(self.six != 0.0, axis=0)
        return moving


def _resampled(t: Array, values: Array, at: Array) -> Array:
    """Interpolate a channel; several samples within a step of the grid are averaged."""
    each = max(int(1 / GRID_HZ / float(np.median(np.diff(t)))), 1)
    even: Array = np.interp(at, t, uniform_filter1d(values, each))
    return even


def moving_triads(one: EvenGrid, two: EvenGrid) -> list[slice]:
    """Triads that move in both."""
    moving = [(one.moving[triad].any(), two.moving[triad].any()) for triad in TRIADS]
    return [triad for triad, both in zip(TRIADS, moving, strict=True) if all(both)]


def overlap(one: EvenGrid, two: EvenGrid, lag: int) -> tuple[Array, Array]:
    """Overlap of both, the second later by `lag` steps, (n, 6) each."""
    begin, stop = max(0, -lag), min(len(two), len(one) - lag)
    return one.six[begin + lag : stop + lag], two.six[begin:stop]
