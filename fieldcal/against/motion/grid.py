"""Channels of a recording at even instants, less what changes slowly."""

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
"""What changes more slowly counts for nothing, s: biases do."""

GAP = 4.0
"""Steps of the grid without a sample from which there is a gap."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Channels at even instants.

    Attributes
    ----------
    start : s
    six : (n, 6) less what changes slowly; 0 where there is nothing
    mean : (6,) of the channels as they are
    there : (n,) whether there were samples

    """

    start: float
    six: Array
    mean: Array
    there: Array

    @classmethod
    def of(cls, block: Block) -> Grid:
        """A block at even instants."""
        t = np.arange(block.t[0], block.t[-1], 1 / GRID_HZ)
        out, mean = np.zeros((len(t), 6)), np.zeros(6)
        for c, values in enumerate(block.six.T):
            known = np.isfinite(values)
            if known.sum() < 2:
                continue
            even = _even(block.t[known], values[known], t)
            mean[c] = even.mean()
            out[:, c] = even - uniform_filter1d(even, int(SLOW_S * GRID_HZ))
        after = np.clip(np.searchsorted(block.t, t), 1, len(block.t) - 1)
        there = block.t[after] - block.t[after - 1] < GAP / GRID_HZ
        return cls(float(t[0]), out * there[:, None], mean, there.astype(float))

    def __len__(self) -> int:
        """Number of instants."""
        return len(self.six)

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Channels that show any motion, (6,)."""
        moving: NDArray[np.bool_] = np.any(self.six != 0.0, axis=0)
        return moving


def _even(t: Array, values: Array, at: Array) -> Array:
    """A channel between its samples; several within a step of the grid are averaged."""
    each = max(int(1 / GRID_HZ / float(np.median(np.diff(t)))), 1)
    even: Array = np.interp(at, t, uniform_filter1d(values, each))
    return even


def shared(one: Grid, two: Grid) -> list[slice]:
    """Triads that move in both."""
    moving = [(one.moving[triad].any(), two.moving[triad].any()) for triad in TRIADS]
    return [triad for triad, both in zip(TRIADS, moving, strict=True) if all(both)]


def overlap(one: Grid, two: Grid, lag: int) -> tuple[Array, Array]:
    """Both where there are both, the second later by `lag` steps, (n, 6) each."""
    begin, stop = max(0, -lag), min(len(two), len(one) - lag)
    return one.six[begin + lag : stop + lag], two.six[begin:stop]
