"""Span of a disturbed window in which the device stayed in the same position.

The mean of a disturbed window is that of its longest calm part (`window_mean`). The
samples before and after the disturbance also count, if the device was still in its
position at the ends of the window: they show whether the base has moved. A device that
was turned away before its window ended measures another force at the end.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.windows import Average

END_S = 1.0
"""Length of the part at an end of the window that is compared, s. At least as much lies
between it and the calm part."""

SAME_FORCE_TOLERANCE = 0.05
"""Largest difference of the force in the same position, as a part of it: 3 degrees."""

Span = tuple[float, float]


def undisturbed_span(block: Block, stated: Span | None, calm: Average) -> Span:
    """Start and end of the span of a window that is used, s of device time.

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
    if start - first > 2 * END_S and _feels_same_force(
        block.between(first, first + END_S), calm
    ):
        start = first
    if last - end > 2 * END_S and _feels_same_force(
        block.between(last - END_S, last), calm
    ):
        end = last
    return start, end


def _feels_same_force(part: Block, calm: Average) -> bool:
    """Whether a part of a window measures the same force as its calm part."""
    if not len(part):
        return False
    off = np.linalg.norm(part.acc.mean(axis=0) - calm.mean[:3])
    return bool(off < SAME_FORCE_TOLERANCE * np.linalg.norm(calm.mean[:3]))
