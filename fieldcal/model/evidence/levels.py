"""The evidence of a set at many instabilities, calculated together.

Only the means of windows and the closures of turns depend on the instability; the
information of all other rows is always the same. With W the whitening of those means at
one instability, and X their columns of the set, further columns, and as the last column
their residuals,

    T = T_0 + X^T W^T W X                                                           (1)

contains G and b of the set, its products R with the further columns, their own M and c,
and the squares of the residuals. With S the prior standard deviations of the set, and 1
for the residuals,

    [L 0; l^T r] [L 0; l^T r]^T = 1 + S T S,    l = L^-1 S b                        (2)
    ln Z = (1 - r^2 - ln |R|) / 2 - ln |L|                                          (3)

is (1) of `eliminated`. After the elimination of the set, the further columns have

    N = L^-1 S R,    M' = M - N^T N,    c' = c - N^T l                              (4)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model.evidence.cholesky import cholesky_root, triangular_inverse
from fieldcal.model.evidence.gram import Gram, WeightedGram

MAX_NUMBERS = 4_000_000
"""Largest number of table elements that are calculated at once: 30 MB."""


class InstabilityScan(NamedTuple):
    """A set, eliminated at each of n instabilities.

    Attributes
    ----------
    score : (n,) ln Z, (3)
    sizes, root, seen : (n, a), (n, a, a), (n, a) S, L and l
    inner, rhs : (n, w, k, k), (n, w, k) M' and c' of blocks of further columns, (4)
    diagonal : (n, w, k) diagonal of M of these columns, before the set is eliminated

    """

    score: Array
    sizes: Array
    root: Array
    seen: Array
    inner: Array
    rhs: Array
    diagonal: Array

    def posterior(self) -> tuple[Array, Array]:
        """Mean (n, a) and covariance (n, a, a) of the set's columns."""
        half = triangular_inverse(self.root) * self.sizes[:, None]
        turned = np.swapaxes(half, 1, 2)
        return (turned @ self.seen[..., None])[..., 0], turned @ half


def scan_instabilities(
    gram: Gram, columns: Index, sizes: Array, taus: Array, further: Index
) -> InstabilityScan:
    """Eliminate a set at each of some instabilities.

    Parameters
    ----------
    gram : Gram matrix of the rows
    columns : (a,) of the set
    sizes : (a,) prior standard deviations; (n, a) if they differ by instability
    taus : (n, 7) instabilities by kind
    further : (w, k) blocks of columns that may be added to the set

    """
    sizes = np.broadcast_to(sizes, (len(taus), len(columns)))
    all_columns = np.concatenate([columns, further.ravel()])
    moved = _affected_means(gram, np.flatnonzero(np.ptp(taus, axis=0)))
    still = replace(gram, info=np.where(moved, 0.0, gram.info)).with_instability(
        taus[0]
    )
    common = _joint_gram(still, all_columns)
    windows: Mask = np.any(moved, axis=1)
    reduced = gram.select_windows(windows, np.where(moved, gram.info, 0.0))
    table = np.append(
        reduced.means[:, :, reduced.index[all_columns]],
        reduced.residual[..., None],
        axis=2,
    )
    rows, width = int(moved.sum()), len(common)
    step = max(1, MAX_NUMBERS // (width * (rows + width)))
    parts = []
    for first in range(0, len(taus), step):
        part = slice(first, first + step)
        root, log_det = reduced.whitening(taus[part])
        white = (root @ table)[:, moved[windows]]
        total = common + np.swapaxes(white, 1, 2) @ white  # (1)
        eliminated = _eliminate(total, sizes[part], further.shape)
        score = eliminated.score - 0.5 * (log_det + still.log_det)
        parts.append(eliminated._replace(score=score))
    return InstabilityScan(*map(np.concatenate, zip(*parts, strict=True)))


def _affected_means(gram: Gram, kinds: Sequence[int] | Index) -> Mask:
    """Means whose noise depends on instabilities of some kinds, (p, 6)."""
    own = np.isin(gram.kind, kinds)
    if bent := [k for k in kinds if k < gram.closure_errors.shape[2]]:
        own |= gram.closure_errors[:, :, bent].any(axis=2)
    turned = gram.free_rotations.any(axis=2)
    own |= turned & np.any(turned & own, axis=1)[:, None]
    return own & (gram.info > 0)


def _joint_gram(rows: WeightedGram, columns: Index) -> Array:
    """T of rows and columns (c,), (c + 1, c + 1)."""
    out = np.empty((len(columns) + 1, len(columns) + 1))
    out[:-1, :-1] = rows.matrix(columns, columns)
    out[-1, :-1] = out[:-1, -1] = rows.rhs(columns)
    out[-1, -1] = rows.square
    return out


def _eliminate(total: Array, sizes: Array, shape: tuple[int, ...]) -> InstabilityScan:
    """(2) to (4) of T, (n, c + 1, c + 1), whose first columns have sizes (n, a)."""
    n, a = sizes.shape
    known = [*range(a), -1]
    wide = np.append(sizes, np.ones((n, 1)), axis=1)
    scaled = total[:, known][:, :, known] * wide[:, :, None] * wide[:, None, :]
    scaled[:, range(a + 1), range(a + 1)] += 1.0
    root_and_rhs = cholesky_root(scaled)
    root, projected = root_and_rhs[:, :-1, :-1], root_and_rhs[:, -1, :-1]
    score = 0.5 * (1 - root_and_rhs[:, -1, -1] ** 2)
    score -= np.log(np.diagonal(root, 0, 1, 2)).sum(axis=1)
    at = a + np.arange(int(np.prod(shape))).reshape(shape)
    own, rhs = total[:, at[:, :, None], at[:, None, :]], total[:, at, -1]
    diagonal = np.diagonal(own, 0, 2, 3)
    if at.size:
        taken = np.linalg.solve(root, total[:, :a, a:-1] * sizes[..., None])
        taken = np.moveaxis(taken.reshape(n, a, *shape), 1, 2)  # (n, w, a, k)
        turned = np.swapaxes(taken, 2, 3)
        own = own - turned @ taken
        rhs = rhs - (turned @ projected[:, None, :, None])[..., 0]
    return InstabilityScan(score, sizes, root, projected, own, rhs, diagonal)
