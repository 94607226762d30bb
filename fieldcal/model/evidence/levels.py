"""A set beside many instabilities of some kinds, without eliminating it for each.

Instability of some kinds is in the noise of the means that are of these kinds. All
other rows leave the columns x of the set at u, with covariance P = H^T H; so x = u +
H^T xi, the means in question are y - A u = A H^T xi + e, and with W the whitening of
their noise at one instability, F = W A H^T and z = W (y - A u),

    V = 1 + F F^T,    ln Z = ln Z_0 - z^T V^-1 z / 2 - ln |V| / 2 - ln |R| / 2      (1)

where ln |R| is that of the noise at it. Of further columns, which show E in these means
and which the other rows leave as M_0 and b_0, there is left

    N = W (E - A P G_E),    M = M_0 + N^T V^-1 N,    b = b_0 + N^T V^-1 z           (2)

V is as wide as these means are many, whatever the columns of the set. Source: the
determinant lemma and the identity of Woodbury.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Index
from fieldcal.model.evidence.gram import Eliminated, Gram

AT_ONCE = 4_000_000
"""Numbers of the tables that are solved at once: 30 MB."""


@dataclass(frozen=True, slots=True)
class Levels:
    """A set beside some instabilities.

    Attributes
    ----------
    score : (n,) ln Z, (1)
    inner, pull : (n, w, k, k), (n, w, k) what the rows say of blocks of further
        columns, (2)
    alone : (n, w, k) the squares of these columns, whatever the set takes off them

    """

    score: Array
    inner: Array
    pull: Array
    alone: Array


def levels(
    gram: Gram,
    columns: Index,
    sizes: Array,
    kinds: Sequence[int],
    taus: Array,
    further: Index,
) -> Levels:
    """A set beside some instabilities.

    Parameters
    ----------
    gram : what the rows say
    columns, sizes : (a,) of the set
    kinds : of the instabilities that differ
    taus : (n, 7) instabilities by kind
    further : (w, k) blocks of columns that the set may be given

    """
    moved = _moved(gram, kinds)
    windows: NDArray[np.bool_] = np.any(moved, axis=1)
    still = replace(gram, info=np.where(moved, 0.0, gram.info))
    base = Eliminated.of(still.weighed(taus[0]), columns, sizes)
    some = gram.at(windows, np.where(moved, gram.info, 0.0))
    table = _table(some, base, further.ravel())
    rows = int(moved.sum())
    size = max(1, AT_ONCE // (rows * (rows + table.shape[2]) + 1))
    parts = []
    for first in range(0, len(taus), size):
        root, log_det = some.whitening(taus[first : first + size])
        white = (root @ table)[:, moved[windows]]
        found = _solved(white, len(columns), further.shape)
        parts.append(replace(found, score=found.score - 0.5 * log_det))
    names = ("score", "inner", "pull", "alone")
    more = (np.concatenate([getattr(p, n) for p in parts]) for n in names)
    return _in_all(Levels(*more), base, further)


def _moved(gram: Gram, kinds: Sequence[int]) -> NDArray[np.bool_]:
    """Means whose noise, or that of what goes with them, is of some kinds, (p, 6)."""
    own = np.isin(gram.kind, kinds)
    if bent := [k for k in kinds if k < gram.bent.shape[2]]:
        own |= gram.bent[:, :, bent].any(axis=2)
    turned = gram.loose.any(axis=2)
    own |= turned & np.any(turned & own, axis=1)[:, None]
    out: NDArray[np.bool_] = own & (gram.info > 0)
    return out


def _table(some: Gram, base: Eliminated, further: Index) -> Array:
    """F, N, z and E before they are whitened, side by side, (p, 6, a + 2 m + 1)."""
    a = some.means[:, :, some.index[base.columns]]
    of_set, shown = a @ base.half.T, some.means[:, :, some.index[further]]
    left = shown - of_set @ (base.half @ base.rows.matrix(base.columns, further))
    off = some.off - a @ base.estimate
    return np.concatenate([of_set, left, off[..., None], shown], axis=2)


def _solved(white: Array, a: int, shape: tuple[int, ...]) -> Levels:
    """What (1) and (2) add, of F, N, z and E side by side, (n, r, a + 2 w k + 1)."""
    n, r, _ = white.shape
    of_set, right, shown = np.split(white, [a, a + int(np.prod(shape)) + 1], axis=-1)
    inner = of_set @ np.swapaxes(of_set, -1, -2)
    inner[..., range(r), range(r)] += 1.0
    root = np.linalg.cholesky(inner)
    both = np.linalg.solve(root, right)
    z = both[..., -1]
    score = -0.5 * (z**2).sum(axis=-1)
    score -= np.log(np.diagonal(root, 0, -2, -1)).sum(axis=-1)
    blocks = np.moveaxis(both[..., :-1].reshape(n, r, *shape), 1, 2)  # (n, w, r, k)
    turned = np.swapaxes(blocks, -1, -2)
    alone = (shown**2).sum(axis=1).reshape(n, *shape)
    return Levels(score, turned @ blocks, (turned @ z[:, None, :, None])[..., 0], alone)


def _in_all(found: Levels, base: Eliminated, further: Index) -> Levels:
    """With what the other rows say added."""
    every = further.ravel()
    inner, pull = base.rest(every, np.ones(len(every)))
    at = np.arange(len(every)).reshape(further.shape)
    alone = np.diagonal(base.rows.matrix(every, every))[at]
    return Levels(
        base.score + found.score,
        found.inner + inner[at[:, :, None], at[:, None, :]],
        found.pull + pull[at],
        found.alone + alone,
    )
