"""Where samples are missing between two positions: the device may have been off.

What was switched on again has other biases than before. Between positions nobody
looks at the samples but for the turn, so a restart shows as nothing but a gap.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.core.sampling import rate_of
from fieldcal.model.rows.bounds import spans
from fieldcal.session.description import Description

OFF_S, PERIODS = 0.5, 5.0
"""Time, and periods of the samples, without any in which a device may restart."""


def interruptions(block: Block, about: Description) -> list[tuple[float, float]]:
    """End of the position before and start of the one after each gap, s."""
    bound = spans(block, about)
    held = bound[bound[:, 1] > bound[:, 0]]
    held = held[np.argsort(held[:, 0])]
    least = max(OFF_S, PERIODS / rate_of(block))
    out = []
    for (_, end), (start, _) in zip(held[:-1], held[1:], strict=True):
        between = block.t[max(end - 1, 0) : start + 1]
        if len(between) > 1 and np.diff(between).max() > least:
            out.append((float(between[0]), float(between[-1])))
    return out
