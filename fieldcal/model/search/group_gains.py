"""All groups of a dictionary in addition to a set, at several instabilities.

All groups with the same number of columns are calculated together, and so are all
instabilities, which is faster than one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.causes.equal_width_groups import EqualWidthGroups
from fieldcal.model.evidence.sets import Sets
from fieldcal.model.evidence.weighted_columns import SplitColumns, WeightedColumns
from fieldcal.model.search.set_at_instability import (
    InstabilityIndices,
    SetAtInstability,
)


class GroupGains:
    """Eliminates a set from all groups, and caches what several sets need."""

    def __init__(self, sets: Sets) -> None:
        self._sets = sets
        self._weighted: dict[InstabilityIndices, WeightedColumns] = {}

    def by_width(
        self, levels: Sequence[SetAtInstability]
    ) -> Iterator[tuple[EqualWidthGroups, Array, Array, Array]]:
        """Matrices M and vectors T b' of (2) of `eliminated` of all groups, by width.

        They are (levels, groups, k, k) and (levels, groups, k). With the largest
        diagonal element of each T G T before the elimination, (levels, groups). The
        levels are those of one set.
        """
        weighted = [self._weighted_columns(level.instability) for level in levels]
        gram, of_set = self._sets.gram, levels[0].state.columns
        within = gram.within.rows(gram.index[of_set])
        halves, rests = [], []
        for columns, level in zip(weighted, levels, strict=True):
            shared = columns.beside(of_set, within)
            halves.append(shared.T @ level.state.half.T)  # rows are read as they lie
            rests.append(columns.rhs - shared.T @ level.state.estimate)
        rest = np.stack(rests)
        for w, alike in enumerate(self._sets.dictionary.groups_by_width):
            own = np.stack([columns.blocks[w] for columns in weighted])
            parts = (half[alike.blocks] for half in halves)  # (b, k, a)
            taken = np.stack([part @ np.swapaxes(part, 1, 2) for part in parts])
            typical, block = alike.typical, alike.block
            inner = (own - taken)[:, block]
            inner *= typical[:, :, None] * typical[:, None, :]
            top = (np.diagonal(own, 0, 2, 3)[:, block] * typical**2).max(axis=-1)
            rhs = rest[:, alike.blocks[block]] * typical
            yield alike, inner, rhs, top

    @cached_property
    def _split(self) -> SplitColumns:
        """All columns, with the blocks of each width."""
        by_width = self._sets.dictionary.groups_by_width
        return SplitColumns(self._sets.gram, [alike.blocks for alike in by_width])

    def _weighted_columns(self, instability: InstabilityIndices) -> WeightedColumns:
        """Products of all columns at one instability; cached."""
        if instability not in self._weighted:
            rows = self._sets.gram_at(instability)
            self._weighted[instability] = WeightedColumns(self._split, rows)
        return self._weighted[instability]
