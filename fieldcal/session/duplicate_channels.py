"""Channels with identical values: one sensor was read, wired or written twice.

The noise of two sensors differs, so their samples are never all equal.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block

FIRST_COMPARED = 100
"""Samples that are compared first."""


def refuse_duplicate_channels(block: Block) -> None:
    """Refuse samples in which one channel of a triad equals another, up to the sign.

    Raises
    ------
    InputError
        Naming both channels.

    """
    for first in (0, 3):
        triad = block.acc if first == 0 else block.gyr
        for i, j in combinations(range(3), 2):
            a, b = triad[:, i], triad[:, j]
            for sign in (1.0, -1.0):
                if _same(a, sign * b) and _varies(a):
                    one, other = CHANNELS[first + i], CHANNELS[first + j]
                    raise InputError(
                        f"{one} and {other} hold the same numbers in every sample: one"
                        " of them is read, wired or written twice; mend the columns or"
                        " the driver, and record again"
                    )


def _same(a: Array, b: Array) -> bool:
    """Whether all values are equal; the first few are compared first, to save time."""
    few = slice(0, FIRST_COMPARED)
    return all(np.array_equal(a[s], b[s], equal_nan=True) for s in (few, slice(None)))


def _varies(values: Array) -> bool:
    known = values[np.isfinite(values)]
    return len(known) > 1 and bool((known != known[0]).any())
