"""How far a window that was cut goes on in the same position.

The mean of a disturbed window is that of its longest calm part (`window_mean`). What
comes before and after the disturbance says as much of the device, and whether the base
stands as it stood: there the samples of the whole window count. A device that was
turned away before its window ended feels another force at the end of it.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.windows import Average

END_S = 1.0
"""End of a window that shows whether it was held on, s: beyond a second of disturbance
there is as much again."""

SAME = 0.05
"""Part of the force by which it may differ in a position that is held on: 3 degrees."""

Span = tuple[float, float]


def held_on(block: Block, stated: Span | None, calm: Average) -> Span:
    """Start and end of what counts of a window, s of device time.

    Parameters
    ----------
    block : the recording
    stated : the window as it was marked
    calm : its calm part

    """
    start, end = calm.start, calm.end
    if stated is None:
        return start, end
    first, last = stated
    if start - first > 2 * END_S and _same(block.between(first, first + END_S), calm):
        start = first
    if last - end > 2 * END_S and _same(block.between(last - END_S, last), calm):
        end = last
    return start, end


def _same(part: Block, calm: Average) -> bool:
    """Whether a part of a window feels the force that its calm part does."""
    if not len(part):
        return False
    off = np.linalg.norm(part.acc.mean(axis=0) - calm.mean[:3])
    return bool(off < SAME * np.linalg.norm(calm.mean[:3]))
