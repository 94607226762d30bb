"""Whether a recording holds positions or is in motion, which decides the comparison.

A car on an even road is as calm as a device at rest, but always in the same position.
Where angles, or rates of a table, are stated, the device was held in positions.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.model import thresholds
from fieldcal.session.description import Description

MAX_SAME_FORCE_COSINE = np.cos(np.deg2rad(10.0))
"""Cosine of the least angle between the forces of two different positions."""


def holds_positions(block: Block, about: Description) -> bool:
    """Whether a recording holds enough different positions."""
    windows = [w for w in about.windows if w is not None]
    if any(p.alpha is not None or p.rate or p.speed for p in about.positions):
        return len(windows) >= thresholds.MIN_ALIKE
    seen: list[Array] = []
    for start, end in windows:
        acc = block.between(start, end).acc
        if not np.isfinite(acc).any(axis=0).all():
            continue
        force = np.nanmean(acc, axis=0)
        up = force / max(float(np.linalg.norm(force)), 1e-12)
        if all(up @ other < MAX_SAME_FORCE_COSINE for other in seen):
            seen.append(up)
    return len(seen) >= thresholds.MIN_ALIKE
