"""A set beside many instabilities, all at once.

Instability of some kinds is in the noise of the means that are of these kinds; all
other rows say the same beside each. With W the whitening of those means at one
instability, and X the set's columns, further ones and last the rows themselves in them,

    T = T_0 + X^T W^T W X                                                           (1)

has G and b of the set, what further columns share with it, R, what they are by
themselves, M and c, and the square of the rows. With S the sizes of the set, and one
for the rows,

    [L 0; l^T r] [L 0; l^T r]^T = 1 + S T S,    l = L^-1 S b                        (2)
    ln Z = (1 - r^2 - ln |R|) / 2 - ln |L|                                          (3)

is (2) of `gram`, and of further columns there is left

    N = L^-1 S R,    M' = M - N^T N,    c' = c - N^T l                              (4)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Index
from fieldcal.model.evidence.gram import Gram, Weighed, inverse_of, root_of

AT_ONCE = 4_000_000
"""Numbers of the tables that are solved at once: 30 MB."""


@dataclass(frozen=True, slots=True)
class Levels:
    """A set beside some instabilities.

    Attributes
    ----------
    score : (n,) ln Z, (3)
    sizes, root, seen : (n, a), (n, a, a), (n, a) S, L and l
    inner, pull : (n, w, k, k), (n, w, k) what the rows say of blocks of further
        columns, (4)
    alone : (n, w, k) the squares of these columns, whatever the set takes off them

    """

    score: Array
    sizes: Array
    root: Array
    seen: Array
    inner: Array
    pull: Array
    alone: Array

    def posterior(self) -> tuple[Array, Array]:
        """Mean (n, a) and covariance (n, a, a) of the set's columns."""
        half = inverse_of(self.root) * self.sizes[:, None]
        turned = np.swapaxes(half, 1, 2)
        return (turned @ self.seen[..., None])[..., 0], turned @ half


def levels(
    gram: Gram, columns: Index, sizes: Array, taus: Array, further: Index
) -> Levels:
    """A set beside some instabilities.

    Parameters
    ----------
    gram : what the rows say
    columns : (a,) of the set
    sizes : (a,) or, beside each instability others, (n, a)
    taus : (n, 7) instabilities by kind
    further : (w, k) blocks of columns that the set may be given

    """
    sizes = np.broadcast_to(sizes, (len(taus), len(columns)))
    every = np.concatenate([columns, further.ravel()])
    moved = _moved(gram, np.flatnonzero(np.ptp(taus, axis=0)))
    still = replace(gram, info=np.where(moved, 0.0, gram.info)).weighed(taus[0])
    common = _products(still, every)
    windows: NDArray[np.bool_] = np.any(moved, axis=1)
    some = gram.at(windows, np.where(moved, gram.info, 0.0))
    table = np.append(some.means[:, :, some.index[every]], some.off[..., None], axis=2)
    rows, width = int(moved.sum()), len(common)
    step = max(1, AT_ONCE // (width * (rows + width)))
    parts = []
    for first in range(0, len(taus), step):
        part = slice(first, first + step)
        root, log_det = some.whitening(taus[part])
        white = (root @ table)[:, moved[windows]]
        total = common + np.swapaxes(white, 1, 2) @ white  # (1)
        found = _eliminated(total, sizes[part], further.shape)
        score = found.score - 0.5 * (log_det + still.log_det)
        parts.append(replace(found, score=score))
    names = Levels.__slots__
    return Levels(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))


def _moved(gram: Gram, kinds: Sequence[int] | Index) -> NDArray[np.bool_]:
    """Means whose noise, or that of what goes with them, is of some kinds, (p, 6)."""
    own = np.isin(gram.kind, kinds)
    if bent := [k for k in kinds if k < gram.bent.shape[2]]:
        own |= gram.bent[:, :, bent].any(axis=2)
    turned = gram.loose.any(axis=2)
    own |= turned & np.any(turned & own, axis=1)[:, None]
    out: NDArray[np.bool_] = own & (gram.info > 0)
    return out


def _products(rows: Weighed, columns: Index) -> Array:
    """T of rows and columns (c,), (c + 1, c + 1)."""
    out = np.empty((len(columns) + 1, len(columns) + 1))
    out[:-1, :-1] = rows.matrix(columns, columns)
    out[-1, :-1] = out[:-1, -1] = rows.pull(columns)
    out[-1, -1] = rows.square
    return out


def _eliminated(total: Array, sizes: Array, shape: tuple[int, ...]) -> Levels:
    """(2) to (4) of T, (n, c + 1, c + 1), whose first columns have sizes (n, a)."""
    n, a = sizes.shape
    known = [*range(a), -1]
    wide = np.append(sizes, np.ones((n, 1)), axis=1)
    scaled = total[:, known][:, :, known] * wide[:, :, None] * wide[:, None, :]
    scaled[:, range(a + 1), range(a + 1)] += 1.0
    both = root_of(scaled)
    root, seen = both[:, :-1, :-1], both[:, -1, :-1]
    score = 0.5 * (1 - both[:, -1, -1] ** 2)
    score -= np.log(np.diagonal(root, 0, 1, 2)).sum(axis=1)
    at = a + np.arange(int(np.prod(shape))).reshape(shape)
    own, pull = total[:, at[:, :, None], at[:, None, :]], total[:, at, -1]
    alone = np.diagonal(own, 0, 2, 3)
    if at.size:
        taken = np.linalg.solve(root, total[:, :a, a:-1] * sizes[..., None])
        taken = np.moveaxis(taken.reshape(n, a, *shape), 1, 2)  # (n, w, a, k)
        turned = np.swapaxes(taken, 2, 3)
        own = own - turned @ taken
        pull = pull - (turned @ seen[:, None, :, None])[..., 0]
    return Levels(score, sizes, root, seen, own, pull, alone)
