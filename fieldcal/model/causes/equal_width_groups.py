"""Groups of equal width, stacked so that numpy calculates them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.cause import Group


@dataclass(frozen=True, slots=True)
class EqualWidthGroups:
    """Groups with equally many leading columns, stacked for joint calculation.

    Attributes
    ----------
    blocks : (b, k) distinct sets of columns; several groups may share a set
    block : (m,) index of each group's set of columns
    typical : (m, k) typical sizes
    cause, variant : (m,) indices of each group's cause and variant

    """

    blocks: Index
    block: Index
    typical: Array
    cause: Index
    variant: Index

    @classmethod
    def of(cls, groups: Sequence[tuple[int, int, Group]]) -> EqualWidthGroups:
        """Stack groups; each is given with the indices of its cause and variant."""
        columns = np.array([g.columns[g.leading_columns] for _, _, g in groups])
        blocks, block = np.unique(columns, axis=0, return_inverse=True)
        typical = np.array([g.typical[g.leading_columns] for _, _, g in groups])
        cause, variant = np.array([(i, j) for i, j, _ in groups]).T
        return cls(blocks, block.ravel(), typical, cause, variant)
