"""Samples that a program wrote as zeros where none came.

Nothing on the ground feels no force at all in all three axes, and turns about none:
such a row is none of the device's.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block

FEWEST, MOST = 2, 0.5
"""Rows of zeros, and the part of the samples from which on they are all that the device
puts out: one alone may be where a counter or a test begins, and does no harm."""


def without_blanks(block: Block) -> tuple[Block, int]:
    """The samples that came, and how many rows of zeros there were beside.

    >>> force = np.repeat([[9.8], [0.0], [9.8]], [2, 2, 3], axis=0) * [0, 1, 0]
    >>> kept, count = without_blanks(Block.of(np.arange(7.0), force, 0 * force))
    >>> kept.t.tolist(), count
    ([0.0, 1.0, 4.0, 5.0, 6.0], 2)
    """
    some = np.flatnonzero(block.acc[:, 0] == 0)
    turns = np.nan_to_num(block.gyr[some])  # there may be no gyroscopes
    blank = some[(block.acc[some] == 0).all(axis=1) & (turns == 0).all(axis=1)]
    if not FEWEST <= len(blank) < MOST * len(block):
        return block, 0
    return block[np.delete(np.arange(len(block)), blank)], len(blank)
