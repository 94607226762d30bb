"""What a recording holds, which decides the comparison: positions, one, or a motion.

A car on an even road is as calm as a device at rest, but always in the same position,
and not all the time. Where angles, or rates of a table, are stated, the device was held
in positions.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.model import thresholds
from fieldcal.session.description import Description

Held = Literal["positions", "one position", "motion"]

MAX_SAME_FORCE_COSINE = np.cos(np.deg2rad(10.0))
"""Cosine of the least angle between the forces of two different positions."""

MIN_REST = 0.9
"""Least part of a recording that windows take up of a device that always rests: the
rest is its beginning, its end and what a bump takes."""


def what_is_held(block: Block, about: Description) -> Held:
    """Whether a recording holds several positions, rests throughout, or moves."""
    count = count_positions(block, about)
    if count >= thresholds.MIN_ALIKE:
        return "positions"
    covered = sum(w[1] - w[0] for w in about.windows if w is not None)
    length = float(np.ptp(block.t)) if len(block.t) else 0.0
    always = count == 1 and covered > MIN_REST * length
    return "one position" if always else "motion"


def count_positions(block: Block, about: Description) -> int:
    """Number of different positions that a recording holds."""
    if any(p.alpha is not None or p.rate or p.speed for p in about.positions):
        return sum(w is not None for w in about.windows)
    return count_attitudes(block, about)


def count_attitudes(block: Block, about: Description) -> int:
    """Number of directions of the force in the windows, whatever angles are stated."""
    seen: list[Array] = []
    for start, end in (w for w in about.windows if w is not None):
        acc = block.between(start, end).acc
        if not np.isfinite(acc).any(axis=0).all():
            continue
        force = np.nanmean(acc, axis=0)
        up = force / max(float(np.linalg.norm(force)), 1e-12)
        if all(up @ other < MAX_SAME_FORCE_COSINE for other in seen):
            seen.append(up)
    return len(seen)
