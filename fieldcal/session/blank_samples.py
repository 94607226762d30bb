"""Samples that a program wrote as zeros where none came.

Nothing on the ground feels no force at all in all three axes, and turns about none:
such a row is none of the device's.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block

MOST = 0.5
"""Part of the samples from which on zeros are all that the device puts out."""


def without_blanks(block: Block) -> tuple[Block, int]:
    """The samples that came, and how many rows of zeros there were beside.

    >>> b = Block.of(np.arange(3.0), np.diag([9.8, 9.8, 0.0]), np.zeros((3, 3)))
    >>> kept, count = without_blanks(b)
    >>> kept.t.tolist(), count
    ([0.0, 1.0], 1)
    """
    turns = np.nan_to_num(block.gyr)  # there may be no gyroscopes
    blank = (block.acc == 0).all(axis=1) & (turns == 0).all(axis=1)
    count = int(blank.sum())
    if not 0 < count < MOST * len(block):
        return block, 0
    return block[np.flatnonzero(~blank)], count
