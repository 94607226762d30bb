"""Estimates averaged over the sets that the search visited.

The best set is not certain: an effect may have all of its parameters or only some, or
an alias may be there instead. Each set s has an estimate, and its probability is its
weight w_s,

    mean = sum_s w_s mean_s
    cov = sum_s w_s [cov_s + (mean_s - mean) (mean_s - mean)^T]                     (1)

A parameter that a set does not have is 0 in it. An effect x that every device has a
little of, and that is not in the set, is eliminated with it. Of the covariance Q before
the rows are seen, M and b' what they say of it after the set is eliminated (see
`model.evidence`),

    P = (Q^-1 + M)^-1
    mean_s - C_s G_sx P b'  and  C_s + C_s G_sx P G_xs C_s                          (2)

stand for mean_s and C_s. Sources: J. Hoeting and others, Bayesian model averaging: a
tutorial, 1999, (1) to (3); for (2), the inverse of a partitioned matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.gram import Eliminated, inverse_of, root_of
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.mixture import KEPT, covariance_of_means
from fieldcal.model.posterior.probabilities import Posterior
from fieldcal.model.posterior.reported import reported

Places = Callable[[Set], Sequence[Index]]
"""Indices of some quantities in the state of a set. A quantity with several indices is
their sum; one without an index is 0."""


Estimate = tuple[Array, Array]
"""Mean (a,) of a set's columns, and a root R of their covariance R R^T, (a, m)."""


class ModelAverage:
    """Averages over the sets of a posterior.

    Parameters
    ----------
    posterior : sets and their probabilities
    best : sets that the best of them stands for, each as likely as the others, as
        numbers are taken from them

    """

    def __init__(self, posterior: Posterior, best: Sequence[Set]) -> None:
        self.posterior, self.best = posterior, best
        self._known: dict[Set, Estimate] = {}

    @cached_property
    def sets(self) -> list[tuple[Set, float]]:
        """Sets that count, as numbers are taken from them, and their weights."""
        every, out = self.posterior.at_points, list[tuple[Set, float]]()
        least = np.exp(-KEPT) * max(w for _, w in every)
        for one, weight in every:
            if weight > least:
                alike = self._with_mixed_sizes(one)
                out += [(s, weight / len(alike)) for s in alike]
        return out

    def _with_mixed_sizes(self, one: Set) -> Sequence[Set]:
        """The set with its estimate averaged over sizes; several for the best set."""
        if one is self.posterior.best:
            return self.best
        return [reported(self.posterior.search, one)]

    def of_member(self, member: Member) -> tuple[Array, Array]:
        """Mean (k,) and covariance (k, k) of a member's parameters, if it is there.

        Where nobody knows the orientations, all axes may be turned, which makes k31 of
        k13: a set that has other parameters has the same device in other axes.
        """
        cause, group = member
        there = [(s, w) for s, w in self.sets if cause.key in s.keys]
        if self.posterior.search.dictionary.free.any():
            mine = set(group.params)
            there = [
                (s, w) for s, w in there if set(_group_in(s, member).params) <= mine
            ]

        there = there or [(s, 1.0) for s in self.best]  # it is too unlikely to count

        def places(one: Set) -> list[Index]:
            own = _group_in(one, member)
            at = dict(zip(own.params or own.columns, own.columns, strict=True))
            wanted = [at.get(p, -1) for p in group.params or group.columns]
            return [np.flatnonzero(one.state.columns == c)[-1:] for c in wanted]

        return averaged(there, places, self._estimate)

    def of_columns(self, columns: Index) -> tuple[Array, Array]:
        """Mean (k,) and covariance (k, k) of columns."""
        return averaged(self.sets, _places_of(columns), self._estimate)

    def _estimate(self, one: Set) -> Estimate:
        """Of a set, with what it leaves out."""
        if one not in self._known:
            left = self.posterior.search.dictionary.unfitted
            self._known[one] = estimate_of(one, left)
        return self._known[one]


def _group_in(one: Set, member: Member) -> Group:
    """The group by which a set has the cause of a member."""
    (own,) = (g for c, g in one.members if c.key == member[0].key)
    return own


def of_columns(
    sets: Sequence[tuple[Set, float]], columns: Index, unfitted: Sequence[Group] = ()
) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of columns over weighed sets."""
    return averaged(sets, _places_of(columns), partial(estimate_of, unfitted=unfitted))


def _places_of(columns: Index) -> Places:
    """Of columns of the dictionary."""
    return lambda one: [np.flatnonzero(one.state.columns == c) for c in columns]


def averaged(
    sets: Sequence[tuple[Set, float]],
    places: Places,
    estimate: Callable[[Set], Estimate] | None = None,
) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of quantities over weighed sets, (1).

    `estimate` of each set, that of its state if not given.
    """
    means, covs = [], []
    for one, _ in sets:
        at = places(one)
        pick = np.zeros((len(at), len(one.state.columns)))
        for row, some in zip(pick, at, strict=True):
            row[some] = 1.0
        mean, root = (estimate or estimate_of)(one)
        picked = pick @ root
        means.append(pick @ mean)
        covs.append(picked @ picked.T)
    weight = np.array([w for _, w in sets])
    weight /= weight.sum()
    mean = weight @ np.array(means)
    cov = np.einsum("s,sij->ij", weight, np.array(covs))
    return mean, cov + covariance_of_means(np.array(means), weight)  # (1)


def with_groups(one: Set, more: Sequence[Group]) -> Eliminated:
    """A set's columns with those of further groups that it leaves out."""
    names, told = {cause.name for cause, _ in one.members}, one.state
    left = [group for group in more if group.part not in names]
    columns = np.concatenate([told.columns, *(group.columns for group in left)])
    sizes = np.concatenate([told.sizes, *(group.typical for group in left)])
    return Eliminated.of(told.rows, columns, sizes)


def estimate_of(one: Set, unfitted: Sequence[Group] = ()) -> Estimate:
    """What a set says of its columns, with those of `unfitted` that it leaves out."""
    names = {cause.name for cause, _ in one.members}
    left = [group for group in unfitted if group.part not in names]
    told = one.state
    if not left:
        return told.estimate, told.half.T
    columns = np.concatenate([group.columns for group in left])
    typical = np.concatenate([group.typical for group in left])
    state = Eliminated.of(told.rows, told.columns, told.sizes)
    inner, pull = state.rest(columns, typical)
    inner.flat[:: len(columns) + 1] += 1.0
    half = inverse_of(root_of(inner))
    shared = state.rows.matrix(state.columns, columns) * typical
    moved = state.inverse @ shared @ half.T
    return told.estimate - moved @ (half @ pull), np.hstack([told.half.T, moved])  # (2)
