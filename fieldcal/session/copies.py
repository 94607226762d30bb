"""Channels that hold each other's numbers: read, wired or written twice.

Two sensors have noise of their own, so their samples are never alike throughout.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block

FEW = 100
"""Samples that are compared before all are."""


def refuse_copies(block: Block) -> None:
    """Refuse samples in which one output is another, or is it with the other sign.

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
    """Whether all are equal; nearly always the first few say that they are not."""
    few = slice(0, FEW)
    return all(np.array_equal(a[s], b[s], equal_nan=True) for s in (few, slice(None)))


def _varies(values: Array) -> bool:
    known = values[np.isfinite(values)]
    return len(known) > 1 and bool((known != known[0]).any())
