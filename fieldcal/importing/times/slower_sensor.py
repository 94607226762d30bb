"""A sensor that is slower than the rows, which lack it between its samples.

0.000,0.1,0.2,9.8,0.01,0.02,0.03   no two neighbours tell its noise, so the rows that
0.005,0.1,0.2,9.8,,,               lack it are left out
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Block, concat

MIN_ROWS = 20
"""Rows of each kind that tell."""

TELLING = 1000
"""Rows at the beginning by which it is told; pieces of a file may have few."""

SLOWER = 0.2
"""Share of rows that lack a sensor which is slower; of others some are lost."""


class SlowerSensor:
    """Leaves out the rows that lack the slower one of two sensors.

    Attributes
    ----------
    says : what the user must know, a sentence each

    """

    def __init__(self) -> None:
        self.says: list[str] = []

    def through(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """All samples, or those of both sensors."""
        flow = iter(blocks)
        first: list[Block] = []
        for block in flow:
            first.append(block)
            if sum(map(len, first)) >= TELLING:
                break
        if not first or not _is_slower(concat(first)):
            yield from chain(first, flow)
            return
        left = 0
        for block in chain(first, flow):
            acc, gyr = known_sensors(block)
            both = acc & gyr
            left += len(block) - int(both.sum())
            yield Block(*(getattr(block, f.name)[both] for f in fields(Block)))
        self.says.append(
            "one of its sensors is slower than its rows: those that lack it are left"
            f" out, {left} in all"
        )


def known_sensors(block: Block) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows (n,) of which the accelerometer is known, and the gyroscope."""
    acc, gyr = (np.isfinite(x.sum(axis=1)) for x in (block.acc, block.gyr))
    return acc, gyr


def _is_slower(block: Block) -> bool:
    """Whether rows of one sensor lie between those of both, few at a time."""
    acc, gyr = known_sensors(block)
    alone, both = acc ^ gyr, acc & gyr
    if both.sum() < MIN_ROWS or alone.sum() <= max(MIN_ROWS, SLOWER * len(block)):
        return False
    starts = np.count_nonzero(np.diff(alone.astype(int)) == 1)
    return bool(starts > min(alone.sum(), both.sum()) / 2)
