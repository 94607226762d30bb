"""Pairs of causes, which may explain rows that neither explains by itself.

Of groups i and j beside a set, the sizes are sought in turn, each beside the other at
its likeliest, by (3) of `gram`: what one alone needs to make up for both it does
not need beside the other. With M_jj = U diag(lambda) U^T and q = U^T b_j, what is left
of i beside j at size v is

    M_ii - S^T E S,    b_i - S^T E q,    S = U^T M_ji,  E = 1 / (lambda + 1 / v^2)  (1)

Where i has more columns than j, its eigenvalues need not be sought again: with
W = U_i^T M_ij E^(1/2), B = 1 / (lambda_i + 1 / u^2) and A = I - W^T B W in its axes,

    |I + u^2 M'| = |I + u^2 M_ii| |A|,
    b'^T (M' + 1 / u^2)^-1 b' = b'^T B b' + (W^T B b')^T A^-1 (W^T B b')           (2)

Source: the determinant lemma and the identity of Woodbury.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby, pairwise
from typing import Self

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.gram import ROUNDED, Eliminated, gained, gains
from fieldcal.model.evidence.sizing import DENSITY, EVEN
from fieldcal.model.priors import SIZES

Pair = tuple[int, int]
Gained = tuple[float, Pair, Pair]


def pairs(
    state: Eliminated,
    groups: Sequence[Group],
    sizes: Sequence[int],
    wanted: Sequence[Pair] | None = None,
) -> Iterator[Gained]:
    """Gain of every two groups beside a set, their numbers, and their sizes.

    Parameters
    ----------
    state : the set, eliminated
    groups : that it may be given
    sizes : index in `priors.SIZES` of each one's likeliest size alone
    wanted : numbers of the groups of each pair, all pairs if not given

    """
    every = list(combinations(range(len(groups)), 2)) if wanted is None else wanted
    if not every:
        return
    columns = np.concatenate([g.columns for g in groups])
    typical = np.concatenate([g.typical for g in groups])
    inner, pull = state.rest(columns, typical)
    first = np.cumsum([0, *(len(g.columns) for g in groups)]).tolist()
    alone = [
        _Alone.of(inner[a:b, a:b], pull[a:b], np.arange(a, b))
        for a, b in pairwise(first)
    ]

    def widths(pair: Pair) -> Pair:
        return len(groups[pair[0]].columns), len(groups[pair[1]].columns)

    for _, some in groupby(sorted(every, key=widths), key=widths):
        both = list(some)
        one, two = (_Stack.of([alone[p[k]] for p in both]) for k in (0, 1))
        start = np.array([sizes[i] for i, _ in both])
        yield from _alike(inner, one, two, start, both)


def _alike(
    inner: Array, one: _Stack, two: _Stack, start: Index, both: Sequence[Pair]
) -> Iterator[Gained]:
    """The same of pairs of which the first and the second are alike in width."""
    shared = inner[one.at[:, :, None], two.at[:, None, :]]
    first, then = _Beside(one, two, shared), _Beside(two, one, shared.swapaxes(1, 2))
    n = np.arange(len(both))
    found = []
    for begin in (start, np.full(len(both), EVEN)):
        v = then.profile(begin).argmax(axis=1)
        profile = first.profile(v)
        u = profile.argmax(axis=1)
        found.append((two.profile[n, v] + profile[n, u], u, v))
    for k, pair in enumerate(both):
        gain, sizes = max((float(g[k]), (int(u[k]), int(v[k]))) for g, u, v in found)
        yield gain, pair, sizes


@dataclass(frozen=True, slots=True)
class _Alone:
    """One group by itself.

    Attributes
    ----------
    at : its columns among those of all groups
    inner, pull : what the rows say of it
    strength, axes, along : eigenvalues, eigenvectors, and the pull along these
    profile : gain and density over the sizes

    """

    at: Index
    inner: Array
    pull: Array
    strength: Array
    axes: Array
    along: Array
    profile: Array

    @classmethod
    def of(cls, inner: Array, pull: Array, at: Index) -> Self:
        strength, axes = np.linalg.eigh(inner)
        seen = strength > ROUNDED * max(np.diag(inner).max(), 1e-300)
        axes, strength = axes * seen, np.where(seen, strength, 0.0)
        along = axes.T @ pull
        profile = gained(strength, along**2) + DENSITY
        return cls(at, inner, pull, strength, axes, along, profile)


class _Stack(_Alone):
    """Several alike in width, (n, ...) each."""

    @classmethod
    def of(cls, some: Sequence[_Alone]) -> Self:  # type: ignore[override]
        return cls(*(np.stack([getattr(s, k) for s in some]) for k in _Alone.__slots__))


class _Beside:
    """Groups beside others, each at some size.

    Parameters
    ----------
    one, other : groups, and those that they are beside
    shared : (n, k, l) what the rows say of both

    """

    def __init__(self, one: _Alone, other: _Alone, shared: Array) -> None:
        self.one, self.other = one, other
        self.shared = shared @ other.axes  # S^T
        self.wide = one.at.shape[1] > other.at.shape[1]
        if self.wide:
            self.shared = np.swapaxes(one.axes, 1, 2) @ self.shared

    def profile(self, size: Index) -> Array:
        """Gain and density over the sizes of the one, (n, sizes)."""
        one, other = self.one, self.other
        kept = 1 / (other.strength + 1 / SIZES[size, None] ** 2)
        taken = (self.shared @ (kept * other.along)[:, :, None])[:, :, 0]
        root = self.shared * np.sqrt(kept)[:, None, :]
        if self.wide:
            return self._in_axes(root, one.along - taken) + DENSITY
        rest = one.inner - root @ np.swapaxes(root, 1, 2)  # (1)
        own = np.diagonal(one.inner, 0, 1, 2).max(axis=1)
        return gains(rest, one.pull - taken, own) + DENSITY

    def _in_axes(self, root: Array, pull: Array) -> Array:
        """The gain by (2), of W (n, k, l) and b' (n, k)."""
        strength = self.one.strength
        wide = SIZES[:, None] ** 2
        back = wide / (1 + wide * strength[:, None, :])  # B, (n, sizes, k)
        weighed = back[:, :, None, :] * np.swapaxes(root, 1, 2)[:, None]
        inner = np.eye(root.shape[2]) - weighed @ root[:, None]
        left = weighed @ pull[:, None, :, None]
        square = (back * pull[:, None, :] ** 2).sum(axis=-1)
        square += (left * np.linalg.solve(inner, left)).sum(axis=(-2, -1))
        log_det = np.log1p(wide * strength[:, None, :]).sum(axis=-1)
        log_det += np.linalg.slogdet(inner)[1]
        gain: Array = 0.5 * (square - log_det)
        return gain
