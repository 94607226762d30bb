"""Groups with the same number of columns, stacked for joint calculation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
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
    known : (m,) whether a group's size v is known to be 1

    """

    blocks: Index
    block: Index
    typical: Array
    cause: Index
    variant: Index
    known: Mask

    @classmethod
    def of(cls, groups: Sequence[tuple[int, int, Group]]) -> EqualWidthGroups:
        """Stack groups; each is given with the indices of its cause and variant."""
        leading = [group.leading for _, _, group in groups]
        columns = np.array([columns for columns, _ in leading])
        blocks, block = np.unique(columns, axis=0, return_inverse=True)
        typical = np.array([sizes for _, sizes in leading])
        cause, variant = np.array([(i, j) for i, j, _ in groups]).T
        known = np.array([g.fixed_size == 1.0 for _, _, g in groups])
        return cls(blocks, block.ravel(), typical, cause, variant, known)
