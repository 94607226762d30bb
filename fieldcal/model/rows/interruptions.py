"""Gaps in the samples between two positions: the device may have restarted.

Biases after a restart differ from those before. Between positions, a restart shows only
as a gap.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.core.sampling import sampling_rate
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.session.description import Description

MIN_INTERRUPTION_S, MIN_INTERRUPTION_PERIODS = 0.5, 5.0
"""Time, and periods of the samples, without any in which a device may restart."""


def interruptions(block: Block, about: Description) -> list[tuple[float, float]]:
    """End of the position before and start of the one after each gap, s."""
    bound = window_bounds(block, about)
    held = bound[bound[:, 1] > bound[:, 0]]
    held = held[np.argsort(held[:, 0])]
    least = max(MIN_INTERRUPTION_S, MIN_INTERRUPTION_PERIODS / sampling_rate(block))
    out = []
    for (_, end), (start, _) in zip(held[:-1], held[1:], strict=True):
        between = block.t[max(end - 1, 0) : start + 1]
        if len(between) > 1 and np.diff(between).max() > least:
            out.append((float(between[0]), float(between[-1])))
    return out
