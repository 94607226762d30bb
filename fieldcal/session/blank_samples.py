"""Rows of zeros that a program wrote in place of missing samples.

A device on the ground never has zero in all six channels.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block

MIN_BLANK_ROWS, MAX_BLANK_SHARE = 2, 0.5
"""Least number of rows of zeros, and the fraction of the samples from which on they are
kept, since the device puts out nothing else. A single row may be the start of a counter
or a test, and does no harm."""


def remove_blank_samples(block: Block) -> tuple[Block, int]:
    """Samples without rows of zeros, and the number of these rows.

    >>> force = np.repeat([[9.8], [0.0], [9.8]], [2, 2, 3], axis=0) * [0, 1, 0]
    >>> kept, count = remove_blank_samples(Block.of(np.arange(7.0), force, 0 * force))
    >>> kept.t.tolist(), count
    ([0.0, 1.0, 4.0, 5.0, 6.0], 2)
    """
    some = np.flatnonzero(block.acc[:, 0] == 0)
    turns = np.nan_to_num(block.gyr[some])  # nan without gyroscopes
    blank = some[(block.acc[some] == 0).all(axis=1) & (turns == 0).all(axis=1)]
    if not MIN_BLANK_ROWS <= len(blank) < MAX_BLANK_SHARE * len(block):
        return block, 0
    return block[np.delete(np.arange(len(block)), blank)], len(blank)
