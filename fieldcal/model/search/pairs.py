"""Pairs of causes, which may explain rows that neither explains by itself.

The sizes of groups i and j, added to a set, are found in turn by (2) of `eliminated`,
each with the other at its most probable size: the size found for one alone is too large
where both are present. With M_jj = U diag(lambda) U^T and q = U^T b_j, the matrix and
vector of i after the elimination of j at size v are

    M_ii - S^T E S,    b_i - S^T E q,    S = U^T M_ji,  E = 1 / (lambda + 1 / v^2)  (1)

If i has more columns than j, its eigenvalues need not be calculated again: with
W = U_i^T M_ij E^(1/2), B = 1 / (lambda_i + 1 / u^2) and A = I - W^T B W in its axes,

    |I + u^2 M'| = |I + u^2 M_ii| |A|,
    b'^T (M' + 1 / u^2)^-1 b' = b'^T B b' + (W^T B b')^T A^-1 (W^T B b')           (2)

What a pair explains grows with its sizes, and no determinant is below one, so

    gain <= q_j^T E q_j / 2 + b'^T (M' + 1 / u^2)^-1 b' / 2    at the largest u, v  (3)

and where that is not below the required gain, with the gain of the wider group j beside
i at its largest size, whose determinant is the smaller factor of that of both,

    gain <= q_i^T E q_i / 2 + gain_j(v)    at the largest u                         (4)

The sizes of pairs with a bound below the required gain are not calculated.

Source: the matrix determinant lemma and the Woodbury identity.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import tolerances
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.eliminated import (
    Eliminated,
    evidence_gains,
    gains_from_eigenvalues,
)
from fieldcal.model.evidence.sets import Set, Sets, is_function
from fieldcal.model.evidence.sizing import LOG_DENSITY, UNIT_INDEX
from fieldcal.model.priors import SIZES
from fieldcal.model.search.offers import Offer, OfferTable

Pair = tuple[int, int]
PairGain = tuple[float, Pair, Pair]


def pair_gains(
    state: Eliminated,
    groups: Sequence[Group],
    sizes: Sequence[int],
    wanted: Sequence[Pair] | None = None,
    least: Sequence[float] | None = None,
) -> Iterator[PairGain]:
    """Gain of pairs of groups in addition to a set: gain, group numbers, size indices.

    Parameters
    ----------
    state : the set, eliminated
    groups : that may be added
    sizes : index in `priors.SIZES` of each group's most probable size alone
    wanted : numbers of the groups of each pair; all pairs if None
    least : gain below which each pair may be omitted

    """
    every = np.array(
        list(combinations(range(len(groups)), 2)) if wanted is None else wanted
    ).reshape(-1, 2)
    if not len(every):
        return
    enough = np.full(len(every), -np.inf) if least is None else np.asarray(least)
    columns = np.concatenate([g.columns for g in groups])
    typical = np.concatenate([g.typical for g in groups])
    inner, rhs = state.schur_complement(columns, typical)
    first = np.cumsum([0, *(len(g.columns) for g in groups)])
    wide = np.diff(first)
    alone = {
        int(w): _SeparateGroups.of(
            inner, rhs, first[:-1][wide == w, None] + np.arange(w)
        )
        for w in np.unique(wide)
    }
    number = np.array([np.sum(wide[:i] == w) for i, w in enumerate(wide)])
    for v, w in np.unique(wide[every], axis=0).tolist():
        numbers = np.flatnonzero((wide[every] == (v, w)).all(axis=1))
        i, j = every[numbers].T
        one, two = alone[v].at_numbers(number[i]), alone[w].at_numbers(number[j])
        shared = inner[one.at[:, :, None], two.at[:, None, :]]
        for bound in (_gain_bound, _closer_bound):
            kept = bound(one, two, shared) >= enough[numbers]
            numbers = numbers[kept]
            if not len(numbers):
                break
            one, two, shared = one.at_numbers(kept), two.at_numbers(kept), shared[kept]
        else:
            start = np.asarray(sizes)[every[numbers, 0]]
            pairs = every[numbers].tolist()
            yield from _gains_of_equal_widths(one, two, shared, start, pairs)


def _gain_bound(one: _SeparateGroups, two: _SeparateGroups, shared: Array) -> Array:
    """Upper bound of each pair's gain, (n,), by (3)."""
    if one.at.shape[1] > two.at.shape[1]:
        one, two, shared = two, one, np.swapaxes(shared, 1, 2)
    largest = np.full(len(shared), len(SIZES) - 1)
    inner, rhs = _GroupsAfterOthers(one, two, shared).rest(largest)
    inner[:, range(inner.shape[1]), range(inner.shape[1])] += SIZES[-1] ** -2
    beside = np.linalg.solve(inner, rhs[:, :, None])[:, :, 0]
    own = (two.along**2 / (two.strength + SIZES[-1] ** -2)).sum(axis=1)
    square = own + (rhs * beside).sum(axis=1)
    most: Array = 0.5 * square + 2 * LOG_DENSITY.max()
    return most


def _closer_bound(one: _SeparateGroups, two: _SeparateGroups, shared: Array) -> Array:
    """Closer upper bound of each pair's gain, (n,), by (4)."""
    if one.at.shape[1] > two.at.shape[1]:
        one, two, shared = two, one, np.swapaxes(shared, 1, 2)
    largest = np.full(len(shared), len(SIZES) - 1)
    beside = _GroupsAfterOthers(two, one, np.swapaxes(shared, 1, 2)).profile(largest)
    own = (one.along**2 / (one.strength + SIZES[-1] ** -2)).sum(axis=1)
    most: Array = 0.5 * own + beside.max(axis=1) + LOG_DENSITY.max()
    return most


def _gains_of_equal_widths(
    one: _SeparateGroups,
    two: _SeparateGroups,
    shared: Array,
    start: Index,
    pairs: Sequence[list[int]],
) -> Iterator[PairGain]:
    """Gains of pairs whose first groups, and whose second groups, have equal widths."""
    first = _GroupsAfterOthers(one, two, shared)
    then = _GroupsAfterOthers(two, one, shared.swapaxes(1, 2))
    n = np.arange(len(pairs))
    maxima = []
    for begin in (start, np.full(len(pairs), UNIT_INDEX)):
        v = then.profile(begin).argmax(axis=1)
        profile = first.profile(v)
        u = profile.argmax(axis=1)
        maxima.append((two.profile[n, v] + profile[n, u], u, v))
    for k, (i, j) in enumerate(pairs):
        gain, sizes = max((float(g[k]), (int(u[k]), int(v[k]))) for g, u, v in maxima)
        yield gain, (i, j), sizes


class _SeparateGroups(NamedTuple):
    """n groups of k columns each, as if each were added to the set without the others.

    Attributes
    ----------
    at : (n, k) their columns among those of all groups
    inner, rhs : (n, k, k), (n, k) M and b of each, after elimination of the set
    strength, axes, along : lambda (n, k), U (n, k, k) and q (n, k)
    profile : (n, sizes) gain plus log prior density at each size

    """

    at: Index
    inner: Array
    rhs: Array
    strength: Array
    axes: Array
    along: Array
    profile: Array

    @classmethod
    def of(cls, inner: Array, rhs: Array, at: Index) -> _SeparateGroups:
        """Groups with columns `at` (n, k), of M and b of the columns of all groups."""
        own, right = inner[at[:, :, None], at[:, None, :]], rhs[at]
        strength, axes = np.linalg.eigh(own)
        top = np.diagonal(own, 0, 1, 2).max(axis=1, keepdims=True)
        determined = strength > tolerances.SINGULAR * np.maximum(top, 1e-300)
        axes = axes * determined[:, None, :]
        strength = np.where(determined, strength, 0.0)
        along = (right[:, None, :] @ axes)[:, 0]
        profile = gains_from_eigenvalues(strength, along**2) + LOG_DENSITY
        return cls(at, own, right, strength, axes, along, profile)

    def at_numbers(self, numbers: Index | Mask) -> _SeparateGroups:
        """The groups of these numbers, which may repeat."""
        return _SeparateGroups._make(values[numbers] for values in self)


class _GroupsAfterOthers:
    """The first groups of n pairs, after elimination of the second groups.

    Parameters
    ----------
    one, other : first and second groups of the pairs
    shared : (n, k, l) M_ij between their columns

    """

    def __init__(
        self, one: _SeparateGroups, other: _SeparateGroups, shared: Array
    ) -> None:
        self.one, self.other = one, other
        self.shared = shared @ other.axes  # S^T
        self.wide = one.at.shape[1] > other.at.shape[1]

    def rest(self, size: Index) -> tuple[Array, Array]:
        """Matrix and vector (1) of the first groups, with the second at sizes (n,).

        `size` are indices in `priors.SIZES`.
        """
        root, taken = self._taken(self.shared, size)
        return self.one.inner - root @ np.swapaxes(root, 1, 2), self.one.rhs - taken

    def profile(self, size: Index) -> Array:
        """Gain plus log density over the sizes of the first groups, (n, sizes)."""
        one = self.one
        if self.wide:
            root, taken = self._taken(np.swapaxes(one.axes, 1, 2) @ self.shared, size)
            return self._in_axes(root, one.along - taken) + LOG_DENSITY
        own = np.diagonal(one.inner, 0, 1, 2).max(axis=1)
        return evidence_gains(*self.rest(size), own) + LOG_DENSITY

    def _taken(self, shared: Array, size: Index) -> tuple[Array, Array]:
        """S^T E^(1/2) and S^T E q of the second groups at some sizes."""
        other = self.other
        kept = 1 / (other.strength + 1 / SIZES[size, None] ** 2)
        taken = (shared @ (kept * other.along)[:, :, None])[:, :, 0]
        return shared * np.sqrt(kept)[:, None, :], taken

    def _in_axes(self, root: Array, rhs: Array) -> Array:
        """Gain (n, sizes) by (2), of W (n, k, l) and b' (n, k)."""
        strength = self.one.strength
        wide = SIZES[:, None] ** 2
        back = wide / (1 + wide * strength[:, None, :])  # B, (n, sizes, k)
        weighed = back[:, :, None, :] * np.swapaxes(root, 1, 2)[:, None]
        inner = np.eye(root.shape[2]) - weighed @ root[:, None]
        left = weighed @ rhs[:, None, :, None]
        square = (back * rhs[:, None, :] ** 2).sum(axis=-1)
        square += (left * np.linalg.solve(inner, left)).sum(axis=(-2, -1))
        log_det = np.log1p(wide * strength[:, None, :]).sum(axis=-1)
        log_det += np.linalg.slogdet(inner)[1]
        gain: Array = 0.5 * (square - log_det)
        return gain


@dataclass(frozen=True, slots=True, eq=False)
class OfferedPair:
    """Two offers that are added to a set together.

    Attributes
    ----------
    first, second : the offers, each at its most probable size beside the other
    score : predicted score of the set with both

    """

    first: Offer
    second: Offer
    score: float

    @property
    def keys(self) -> tuple[str, str]:
        """Keys of the two causes."""
        return self.first.member[0].key, self.second.member[0].key


def offered_pairs(
    sets: Sets, current: Set, table: OfferTable, least: float
) -> Iterator[OfferedPair]:
    """Pairs of a table's offers; those with a score below `least` may be omitted.

    Offers are also tried with all their parameters.
    """
    narrow = [o for o in table.offers if not is_function(o.member)][
        : tolerances.PAIRED_CAUSES
    ]
    offers = [*narrow, *(o.with_all_parameters() for o in narrow)]
    count = len(narrow)
    widened = [a is not b for a, b in zip(narrow, offers[count:], strict=True)]
    pairs, log_prior = [], {}
    before = sets.set_log_prior(current.members)
    for i, j in combinations(range(count), 2):
        wide = i + widened[i] * count, j + widened[j] * count
        both = [*current.members, narrow[i].member, narrow[j].member]
        chance = sets.set_log_prior(both) - before
        for pair in {(i, j), wide}:
            pairs.append(pair)
            log_prior[pair] = chance
    groups, sizes = [o.member[1] for o in offers], [o.size for o in offers]
    enough = [least - table.score - log_prior[pair] for pair in pairs]
    for gain, pair, (u, v) in pair_gains(table.state, groups, sizes, pairs, enough):
        first, second = (offers[i] for i in pair)
        yield OfferedPair(
            replace(first, size=u),
            replace(second, size=v),
            table.score + (gain + log_prior[pair]),
        )
