"""Rows of zeros that a program wrote in place of missing samples.

A device on the ground never has zero in all six channels.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block, Index

MIN_BLANK_ROWS, MAX_BLANK_SHARE = 2, 0.5
"""Least number of rows of zeros, and the fraction of the samples from which on they are
kept, since the device puts out nothing else. A single row may be the start of a counter
or a test, and does no harm."""


def blank_rows(block: Block) -> Index:
    """Numbers of the rows of zeros; missing rates are ignored.

    >>> blank_rows(Block.of(np.arange(3.0), np.zeros((3, 3)))).tolist()
    [0, 1, 2]
    """
    some = np.flatnonzero(block.acc[:, 0] == 0)
    turns = np.nan_to_num(block.gyr[some])  # nan without gyroscopes
    blank: Index = some[(block.acc[some] == 0).all(axis=1) & (turns == 0).all(axis=1)]
    return blank


def are_lost(blank: int, rows: int) -> bool:
    """Whether so many rows of zeros among all rows of a recording are lost samples.

    >>> are_lost(3, 100), are_lost(1, 100), are_lost(60, 100)
    (True, False, False)
    """
    return MIN_BLANK_ROWS <= blank < MAX_BLANK_SHARE * rows


def without_rows(block: Block, some: Index) -> Block:
    """Samples but for some rows."""
    return block[np.delete(np.arange(len(block)), some)] if len(some) else block


def blank_warning(count: int) -> str:
    """Sentence about rows of zeros that were left out."""
    return (
        f"{count} samples are zero in all outputs, which no device on the"
        " ground puts out: they count as lost"
    )


def remove_blank_samples(block: Block) -> tuple[Block, int]:
    """Samples of a whole recording without rows of zeros, and the number of these.

    >>> force = np.repeat([[9.8], [0.0], [9.8]], [2, 2, 3], axis=0) * [0, 1, 0]
    >>> kept, count = remove_blank_samples(Block.of(np.arange(7.0), force, 0 * force))
    >>> kept.t.tolist(), count
    ([0.0, 1.0, 4.0, 5.0, 6.0], 2)
    """
    blank = blank_rows(block)
    if not are_lost(len(blank), len(block)):
        return block, 0
    return without_rows(block, blank), len(blank)
