"""Single samples that jump away and back: a byte decoded wrongly, a knock on a wire.

    |x_i - x_(i-1)|, |x_(i+1) - x_i| > 12 s,   |x_(i+1) - x_(i-1)| < 0.3 of both    (1)

x_i are the samples of one channel, and s is the typical difference of successive
samples. Such a jump is no motion of the device, so the search for rests ignores it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Block

WILD = 12.0
"""Least jump, in typical differences; noise does not reach it."""

BACK = 0.3
"""Largest difference between the samples before and after the jump, as a part of it."""


def without_spikes(block: Block) -> Block:
    """The block with nan in place of single samples that jump by (1)."""
    acc = _without_single_jumps(block.acc)
    gyr = _without_single_jumps(block.gyr)
    if acc is block.acc and gyr is block.gyr:
        return block
    return replace(block, acc=acc, gyr=gyr)


def _without_single_jumps(triad: Array) -> Array:
    """The samples (n, 3) with nan where (1) holds; the same array if it never does."""
    if len(triad) < len("abc"):
        return triad
    step = np.abs(np.diff(triad, axis=0))
    usual = MAD_TO_SIGMA * _median(step)
    # most differences of coarse outputs are 0
    least = np.where(step > 0, step, np.inf).min(axis=0, initial=np.inf)
    usual = np.where(usual > 0, usual, least)
    first, second = step[:-1], step[1:]
    lower = np.minimum(first, second)
    with np.errstate(invalid="ignore"):
        back = np.abs(triad[2:] - triad[:-2]) < BACK * lower
        wild = (lower > WILD * usual) & back  # (1)
    if not wild.any():
        return triad
    calmed = triad.copy()
    calmed[1:-1][wild] = np.nan
    return calmed


def _median(step: Array) -> Array:
    """Median of each column (n, 3) over what is known; 0 where nothing is."""
    known = [column[np.isfinite(column)] for column in step.T]
    return np.array([np.median(axis) if len(axis) else 0.0 for axis in known])
