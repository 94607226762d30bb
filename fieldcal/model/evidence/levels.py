"""The evidence of a set at many instabilities, calculated together.

Only the means of windows and the closures of turns depend on the instability; the
information of all other rows is always the same. With W the whitening of those means at
one instability, and X their columns of the set, their residuals as a column beside
these, and further columns,

    T = T_0 + X^T W^T W X                                                           (1)

contains G and b of the set, its products R with the further columns, their own M and c,
and the squares of the residuals. With S the prior standard deviations of the set, and 1
for all others,

    [L 0 0; l^T r 0; N^T * *] [L 0 0; l^T r 0; N^T * *]^T = 1 + S T S,
    l = L^-1 S b,    N = L^-1 S R                                                   (2)
    ln Z = (1 - r^2 - ln |R|) / 2 - ln |L|                                          (3)

is (1) of `eliminated`. After the elimination of the set, the further columns have

    M' = M - N^T N,    c' = c - N^T l                                               (4)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import tolerances
from fieldcal.model.evidence.cholesky import cholesky_root, triangular_inverse
from fieldcal.model.evidence.gram import Gram


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
    moved = _affected_means(gram, np.flatnonzero(np.ptp(taus, axis=0)))
    still = replace(gram, info=np.where(moved, 0.0, gram.info))
    common, fixed_log_det = _joint_gram(still, taus[0], columns, further.ravel())
    windows: Mask = np.any(moved, axis=1)
    reduced = gram.select_windows(windows, np.where(moved, gram.info, 0.0))
    table = _joint_table(reduced, columns, further.ravel())
    rows, width = int(moved.sum()), len(common)
    step = max(1, tolerances.MAX_NUMBERS // (width * (rows + width)))
    parts = []
    for first in range(0, len(taus), step):
        part = slice(first, first + step)
        white, log_det = reduced.whitened(taus[part], table)
        total = common + np.swapaxes(white, 1, 2) @ white  # (1)
        eliminated = _eliminate(total, sizes[part], further.shape)
        score = eliminated.score - 0.5 * (log_det + fixed_log_det)
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


def _joint_table(gram: Gram, columns: Index, further: Index) -> Array:
    """X of the set's columns (a,), the residuals and further ones, (p, 6, c)."""
    of_set, others = (gram.means[:, :, gram.index[at]] for at in (columns, further))
    return np.concatenate([of_set, gram.residual[..., None], others], axis=2)


def _joint_gram(
    gram: Gram, tau: Array, columns: Index, further: Index
) -> tuple[Array, float]:
    """T (c, c) of rows at one instability (7,), in the order of X, and their ln |R|."""
    rows, a = gram.with_instability(tau), len(columns)
    every = np.concatenate([columns, further])
    at = np.delete(np.arange(len(every) + 1), a)
    out = np.empty((len(every) + 1, len(every) + 1))
    out[np.ix_(at, at)], rhs = rows.normal_equations(every)
    out[a, at] = out[at, a] = rhs
    out[a, a] = rows.square
    return out, rows.log_det


def _eliminate(total: Array, sizes: Array, shape: tuple[int, ...]) -> InstabilityScan:
    """(2) to (4) of T, (n, c, c), whose first columns have sizes (n, a)."""
    n, a = sizes.shape
    wide = np.ones(total.shape[:2])
    wide[:, :a] = sizes
    scaled = total * wide[:, :, None]
    scaled *= wide[:, None, :]
    scaled[:, range(len(wide[0])), range(len(wide[0]))] += 1.0
    whole = cholesky_root(scaled)
    root, projected = whole[:, :a, :a], whole[:, a, :a]
    score = 0.5 * (1 - whole[:, a, a] ** 2)
    score -= np.log(np.diagonal(root, 0, 1, 2)).sum(axis=1)
    at = a + 1 + np.arange(int(np.prod(shape))).reshape(shape)
    own, rhs = total[:, at[:, :, None], at[:, None, :]], total[:, at, a]
    diagonal = np.diagonal(own, 0, 2, 3)
    if at.size:
        turned = whole[:, at, :a]  # N^T, (n, w, k, a)
        own = own - turned @ np.swapaxes(turned, 2, 3)
        rhs = rhs - (turned @ projected[:, None, :, None])[..., 0]
    return InstabilityScan(score, sizes, root, projected, own, rhs, diagonal)
