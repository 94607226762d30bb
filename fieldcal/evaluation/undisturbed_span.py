"""Span of a disturbed window in which the device stayed in the same position.

The mean of a disturbed window is that of its longest calm part (`window_mean`). The
samples before and after the disturbance are used too, if the device was in the same
position at the ends of the window, because they show whether the base has moved. If the
device was turned away before its window ended, the force at the end differs.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.windows import Average

END_S = 1.0
"""Length of the part at an end of the window that is compared, s. The distance from it
to the calm part is at least as long."""

SAME_FORCE_TOLERANCE = 0.05
"""Largest difference of the force in the same position, as a part of the force; as an
angle it is 3 degrees."""

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
