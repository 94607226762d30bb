"""The evidence that sessions share something, and at which level.

An effect of some level has one value in each group of it: each device, lot, station,
or session. With M_s and q_s of the sessions (`reduced`), and Z_a the incidence of
sessions in the groups of level a,

    G_ab = sum_s Z_a[s] Z_b[s]^T (x) M_s[a, b],    b_a = sum_s Z_a[s] (x) q_s[a]  (1)
    ln Z = b^T S (I + S G S)^-1 S b / 2 - ln |I + S G S| / 2                       (2)

with S the sizes v of each effect at each level, which are summed over as in one
session (`model.evidence.sets`). Evidence adds over sessions: what is two sigma in each
of fifty is fourteen in all. Source: as `model.evidence.gram`; levels are random
effects, crossed or nested (Searle, Casella and McCulloch, Variance Components, 1992).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.evidence.gram import evidence_gains

DENSITY = np.log(priors.density())

EVEN = int(np.argmin(np.abs(np.log(priors.SIZES))))
"""Index of v = 1."""

ROUNDS = 4
"""Times that each size is sought beside the others."""


@dataclass(frozen=True, slots=True, eq=False)
class Grouping:
    """One way in which sessions belong together.

    Attributes
    ----------
    names : of the levels that group them so; several where no session tells them apart
    labels : of the groups
    index : (s,) number of each session's group

    """

    names: tuple[str, ...]
    labels: tuple[str, ...]
    index: Index

    @classmethod
    def of(cls, name: str, values: Sequence[str]) -> Grouping:
        """By the value that each session has."""
        labels, index = np.unique(np.array(values), return_inverse=True)
        return cls((name,), tuple(labels.tolist()), index.ravel())


def groupings(
    sessions: Sequence[Mapping[str, str]], levels: Iterable[str]
) -> list[Grouping]:
    """Levels that all sessions know, those that group them alike as one.

    The one with the fewest groups is first; where none has a single group, one of all
    sessions is added.
    """
    found: dict[tuple[int, ...], Grouping] = {}
    for name in levels:
        values = [one.get(name, "") for one in sessions]
        if not all(values):
            continue
        made = Grouping.of(name, values)
        first: dict[int, int] = {}
        key = tuple(first.setdefault(int(i), len(first)) for i in made.index)
        if key in found:
            before = found[key]
            names = (*before.names, *made.names)
            pairs = zip(before.labels, _matched(before, made), strict=True)
            labels = tuple(f"{a}, {name} {b}" for a, b in pairs)
            made = Grouping(names, labels, before.index)
        found[key] = made
    if all(len(one.labels) > 1 for one in found.values()):
        found[(-1,)] = Grouping.of("all", ["every session"] * len(sessions))
    return sorted(found.values(), key=lambda one: len(one.labels))


def _matched(one: Grouping, other: Grouping) -> list[str]:
    """Labels of another grouping that is alike, in the order of one."""
    sessions = [int(np.flatnonzero(one.index == g)[0]) for g in range(len(one.labels))]
    return [other.labels[other.index[s]] for s in sessions]


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """An effect at a level.

    Attributes
    ----------
    columns : (k,) of the sessions' matrices
    grouping : the level

    """

    columns: Index
    grouping: Grouping

    @property
    def width(self) -> int:
        """Columns in all groups together."""
        return len(self.columns) * len(self.grouping.labels)


@dataclass(frozen=True, slots=True)
class WeighedMembers:
    """Members with their sizes at the likeliest.

    Attributes
    ----------
    members : of the set
    sizes : v of each
    score : ln of the evidence, summed over sizes
    mean, covariance : of all values, member by member, group by group, in typical sizes

    """

    members: tuple[Member, ...]
    sizes: tuple[float, ...]
    score: float
    mean: Array
    covariance: Array

    def of(self, i: int) -> tuple[Array, Array]:
        """Values and standard uncertainties of one member, (groups, k) each."""
        ends = np.cumsum([0, *(m.width for m in self.members)])
        at = slice(ends[i], ends[i + 1])
        shape = (len(self.members[i].grouping.labels), -1)
        sigma = np.sqrt(np.diag(self.covariance)[at])
        return self.mean[at].reshape(shape), sigma.reshape(shape)


class Sessions:
    """What sessions say of columns that they have in common.

    Parameters
    ----------
    matrix, pull : M (s, k, k) and q (s, k) of each

    """

    def __init__(self, matrix: Array, pull: Array) -> None:
        self.matrix, self.pull = matrix, pull

    def weighed(self, members: Sequence[Member]) -> WeighedMembers:
        """A set with its sizes sought one beside the others."""
        inner, pull, places = self._together(members)
        sizes = [EVEN] * len(members)
        profiles: list[Array] = []
        for _ in range(ROUNDS if len(members) > 1 else 1):
            before = list(sizes)
            profiles = [
                self._profile(inner, pull, places, sizes, i)
                for i in range(len(members))
            ]
            if sizes == before and len(members) > 1:
                break
        wide = [float(priors.SIZES[i]) for i in sizes]
        score, mean, covariance = _solved(inner, pull, self._spread(wide, places))
        score += sum(float(DENSITY[i]) for i in sizes)
        score += sum(float(np.logaddexp.reduce(p - p.max())) for p in profiles)
        return WeighedMembers(tuple(members), tuple(wide), score, mean, covariance)

    def offered(self, base: WeighedMembers, member: Member) -> float:
        """What a further member adds to a set's score with its sizes as they are."""
        if not base.members:
            blocks = self._blocks(member)
            gain = evidence_gains(*blocks, _own(blocks[0])).sum(axis=0)
            return float(np.logaddexp.reduce(gain + DENSITY))
        every = [*base.members, member]
        inner, pull, places = self._together(every)
        known = np.repeat(base.sizes, [m.width for m in base.members])
        gain = _gain(inner, pull, places[-1], known)
        return float(np.logaddexp.reduce(gain + DENSITY))

    def _blocks(self, member: Member) -> tuple[Array, Array]:
        """G and b of a member by itself, (groups, k, k) and (groups, k)."""
        k, count = len(member.columns), len(member.grouping.labels)
        inner, pull = np.zeros((count, k, k)), np.zeros((count, k))
        at = member.columns
        np.add.at(inner, member.grouping.index, self.matrix[:, at[:, None], at])
        np.add.at(pull, member.grouping.index, self.pull[:, at])
        return inner, pull

    def _together(self, members: Sequence[Member]) -> tuple[Array, Array, list[slice]]:
        """G, b of (1), and where each member stands in them."""
        ends = np.cumsum([0, *(m.width for m in members)]).tolist()
        places = [slice(a, b) for a, b in pairwise(ends)]
        inner, pull = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1])
        for one, here in zip(members, places, strict=True):
            rows, k = one.grouping.index, len(one.columns)
            np.add.at(pull[here].reshape(-1, k), rows, self.pull[:, one.columns])
            for other, there in zip(members, places, strict=True):
                j = len(other.columns)
                part = np.zeros((one.width // k, other.width // j, k, j))
                each = self.matrix[:, one.columns[:, None], other.columns]
                np.add.at(part, (rows, other.grouping.index), each)
                inner[here, there] = part.transpose(0, 2, 1, 3).reshape(
                    one.width, other.width
                )
        return inner, pull, places

    @staticmethod
    def _spread(wide: Sequence[float], places: Sequence[slice]) -> Array:
        parts = [
            np.full(p.stop - p.start, w) for w, p in zip(wide, places, strict=True)
        ]
        return np.concatenate([np.empty(0), *parts])

    def _profile(
        self,
        inner: Array,
        pull: Array,
        places: Sequence[slice],
        sizes: list[int],
        i: int,
    ) -> Array:
        """F over the sizes of one member, its size being set to the likeliest."""
        others = np.ones(len(pull), dtype=bool)
        others[places[i]] = False
        order = np.concatenate([np.flatnonzero(others), np.flatnonzero(~others)])
        wide = self._spread([float(priors.SIZES[s]) for s in sizes], places)[others]
        last = slice(int(others.sum()), len(pull))
        gain = _gain(inner[np.ix_(order, order)], pull[order], last, wide)
        profile: Array = gain + DENSITY
        sizes[i] = int(np.argmax(profile))
        return profile


def _gain(inner: Array, pull: Array, last: slice, wide: Array) -> Array:
    """Gain over all sizes of the last columns, those before having sizes (a,)."""
    first = slice(0, last.start)
    scaled = inner[first, first] * wide * wide[:, None] + np.eye(last.start)
    right = np.column_stack([inner[first, last], pull[first]]) * wide[:, None]
    solved = np.linalg.solve(scaled, right)
    left = inner[last, first] * wide
    own = inner[last, last]
    less = own - left @ solved[:, :-1]
    gain: Array = evidence_gains(less, pull[last] - left @ solved[:, -1], _own(own))
    return gain


def _own(inner: Array) -> Array:
    """Largest diagonal element of matrices (..., k, k)."""
    largest: Array = np.diagonal(inner, 0, -2, -1).max(axis=-1, initial=0.0)
    return largest


def _solved(inner: Array, pull: Array, wide: Array) -> tuple[float, Array, Array]:
    """Evidence (2), mean and covariance at sizes (a,)."""
    scaled = inner * wide * wide[:, None] + np.eye(len(wide))
    root = np.linalg.cholesky(scaled)
    half = np.linalg.solve(root, np.diag(wide))
    seen = half @ pull
    score = 0.5 * float(seen @ seen) - float(np.log(np.diag(root)).sum())
    return score, half.T @ seen, half.T @ half
