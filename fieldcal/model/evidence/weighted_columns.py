"""All columns of a Gram matrix at one instability, with their products.

    Phi_i^T R^-1 Phi_j = W_ij + sum_p m_ip^T R_p^-1 m_jp                           (1)

of the columns i and j, with W_ij the courses within windows, m_ip (6,) the means in
window p, and R_p the covariance of the six means there, on which alone an instability
has an influence. Many columns have a mean in one window only, such as an angle of one
position, or the offset of one window; their sums (1) have one term. Where each of many
rows is a position of its own, nearly all columns are such.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model.evidence.gram import Gram, WeightedGram


@dataclass(frozen=True, slots=True)
class _EqualBlocks:
    """Blocks of k columns each, whose products with themselves are wanted.

    Attributes
    ----------
    within : (m, k, k) W of each
    single : (m,) whether all columns of a block have their means in one window
    window, means : (s,), (s, 6, k) that window, and the means, of these blocks
    at : (m - s, k) columns of the others

    """

    within: Array
    single: Mask
    window: Index
    means: Array
    at: Index


class SplitColumns:
    """Columns of a Gram matrix, by whether they have means in several windows.

    `blocks` are columns of the dictionary, (m, k) for each width k, whose products with
    themselves are wanted.

    Attributes
    ----------
    wide : (u,) columns of this matrix with means in several windows, or in wide blocks;
        all if these are the most
    single, window, means : (s,), (s,), (s, 6) all others, their windows, and the means

    """

    def __init__(self, gram: Gram, blocks: Sequence[Index]) -> None:
        self.gram = gram
        touched: Mask = np.any(gram.means, axis=1)  # (p, k)
        places = [gram.index[columns] for columns in blocks]
        seen: list[Mask] = [np.any(touched[:, at], axis=2) for at in places]  # (p, m)
        alone = [windows.sum(axis=0) <= 1 for windows in seen]
        wide = touched.sum(axis=0) > 1
        for at, one in zip(places, alone, strict=True):
            wide[at[~one]] = True
        if 2 * wide.sum() > len(wide):
            wide[:] = True  # taking some of many columns apart costs more than it saves
        self.wide, self.single = np.flatnonzero(wide), np.flatnonzero(~wide)
        self.window = touched[:, self.single].argmax(axis=0)
        self.means = gram.means[self.window, :, self.single]
        self.blocks = []
        for at, one, windows in zip(places, alone, seen, strict=True):
            window = windows[:, one].argmax(axis=0)
            means = np.moveaxis(gram.means[window[:, None], :, at[one]], 1, 2)
            within = gram.within.diagonal_parts(at)
            others = np.searchsorted(self.wide, at[~one])
            self.blocks.append(_EqualBlocks(within, one, window, means, others))


class WeightedColumns:
    """All columns of a Gram matrix at one instability.

    Attributes
    ----------
    rows : the matrix weighted with the instability
    rhs : (k,) Phi^T R^-1 (y - h)
    blocks : products (1) of the blocks with themselves, (m, k, k) for each width

    """

    def __init__(self, split: SplitColumns, rows: WeightedGram) -> None:
        self.rows, self._split, known = rows, split, split.gram.info > 0
        self._wide = rows.whitened(split.wide)
        self._single = rows.whiten(split.means[..., None], split.window)[..., 0]
        self.rhs = split.gram.rhs.copy()
        self.rhs[split.wide] += self._wide.T @ rows.residual[known]
        self.rhs[split.single] += (self._single * rows.residual[split.window]).sum(1)
        self.blocks = [self._products(block) for block in split.blocks]

    def beside(self, columns: Index, within: Array) -> Array:
        """Products (1) of some columns (c,) of the dictionary with all, (c, k).

        `within` (c, k) is W of these.
        """
        split, gram, out = self._split, self._split.gram, within.copy()
        white = self.rows.whiten(gram.means[:, :, gram.index[columns]])
        shared = white[gram.info > 0].T @ self._wide
        if not len(split.single):
            out += shared
            return out
        out[:, split.wide] += shared
        alone = self._single[:, None] @ white[split.window]  # (s, 1, c)
        out[:, split.single] += alone[:, 0].T
        return out

    def _products(self, block: _EqualBlocks) -> Array:
        """Products of blocks with themselves, (m, k, k)."""
        out = block.within.copy()
        alone = self.rows.whiten(block.means, block.window)
        out[block.single] += np.swapaxes(alone, 1, 2) @ alone
        several = np.moveaxis(self._wide[:, block.at], 0, 1)  # (m - s, r, k)
        out[~block.single] += np.swapaxes(several, 1, 2) @ several
        return out
