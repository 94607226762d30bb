"""The evidence that sessions share an effect, and at which level.

A level divides the sessions into groups: by device, lot, station or session. An effect
at a level has one value in each group of the level. With M_s and q_s of the sessions
(`reduced`), and Z_a the incidence of sessions in the groups of level a,

    G_ab = sum_s Z_a[s] Z_b[s]^T (x) M_s[a, b],    b_a = sum_s Z_a[s] (x) q_s[a]  (1)
    ln Z = b^T S (I + S G S)^-1 S b / 2 - ln |I + S G S| / 2                       (2)

with S the sizes v of each effect at each level; (2) is summed over v as for a single
session (`model.evidence.sets`). Evidence adds over sessions: a value of two sigma in
each of fifty sessions has fourteen sigma in all. Source: as `model.evidence.gram`;
levels are random effects, crossed or nested (Searle, Casella and McCulloch, Variance
Components, 1992).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors
from fieldcal.model.evidence.eliminated import evidence_gains

DENSITY = np.log(priors.density())
"""Logarithm of the prior density of each size."""

UNIT_INDEX = int(np.argmin(np.abs(np.log(priors.SIZES))))
"""Index of v = 1."""

ROUNDS = 4
"""Largest number of passes in which each size is maximised with the others fixed."""


@dataclass(frozen=True, slots=True, eq=False)
class Grouping:
    """Division of the sessions into groups.

    Attributes
    ----------
    names : levels that group the sessions in this way; several if they group alike
    labels : names of the groups
    index : (s,) number of each session's group

    """

    names: tuple[str, ...]
    labels: tuple[str, ...]
    index: Index

    @classmethod
    def of(cls, name: str, values: Sequence[str]) -> Grouping:
        """Group sessions by the value (s,) that each has at a level."""
        labels, index = np.unique(np.array(values), return_inverse=True)
        return cls((name,), tuple(labels.tolist()), index.ravel())


def groupings(
    sessions: Sequence[Mapping[str, str]], levels: Iterable[str]
) -> list[Grouping]:
    """Return the groupings by all levels that every session states.

    Levels that group the sessions alike make one grouping. The grouping with the fewest
    groups is first. If none has a single group, one of all sessions is added.
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
            pairs = zip(before.labels, _matched_labels(before, made), strict=True)
            labels = tuple(f"{a}, {name} {b}" for a, b in pairs)
            made = Grouping(names, labels, before.index)
        found[key] = made
    if all(len(one.labels) > 1 for one in found.values()):
        found[(-1,)] = Grouping.of("all", ["every session"] * len(sessions))
    return sorted(found.values(), key=lambda one: len(one.labels))


def _matched_labels(one: Grouping, other: Grouping) -> list[str]:
    """Labels of `other` in the order of `one`; both group the sessions alike."""
    sessions = [int(np.flatnonzero(one.index == g)[0]) for g in range(len(one.labels))]
    return [other.labels[other.index[s]] for s in sessions]


@dataclass(frozen=True, slots=True, eq=False)
class LevelEffect:
    """An effect at a level.

    Attributes
    ----------
    columns : (k,) numbers of the effect's columns in the sessions' matrices
    grouping : groups of the level

    """

    columns: Index
    grouping: Grouping

    @property
    def width(self) -> int:
        """Number of columns in all groups together."""
        return len(self.columns) * len(self.grouping.labels)


@dataclass(frozen=True, slots=True)
class EffectSetPosterior:
    """Posterior of a set of effects at the most probable sizes.

    Attributes
    ----------
    effects : effects of the set
    sizes : v of each
    score : log evidence, summed over sizes
    mean, covariance : of all values, effect by effect, group by group, in typical sizes

    """

    effects: tuple[LevelEffect, ...]
    sizes: tuple[float, ...]
    score: float
    mean: Array
    covariance: Array

    def effect_values(self, i: int) -> tuple[Array, Array]:
        """Values and standard uncertainties of effect i, (groups, k) each."""
        ends = np.cumsum([0, *(m.width for m in self.effects)])
        at = slice(ends[i], ends[i + 1])
        shape = (len(self.effects[i].grouping.labels), -1)
        sigma = np.sqrt(np.diag(self.covariance)[at])
        return self.mean[at].reshape(shape), sigma.reshape(shape)


class PooledSessions:
    """Information of several sessions about columns that they have in common.

    Parameters
    ----------
    matrix, rhs : M (s, k, k) and q (s, k) of each

    """

    def __init__(self, matrix: Array, rhs: Array) -> None:
        self.matrix, self.rhs = matrix, rhs

    def posterior(self, members: Sequence[LevelEffect]) -> EffectSetPosterior:
        """Posterior of a set of effects; each size is maximised in turn."""
        inner, rhs, places = self._combined_blocks(members)
        sizes = [UNIT_INDEX] * len(members)
        profiles: list[Array] = []
        for _ in range(ROUNDS if len(members) > 1 else 1):
            before = list(sizes)
            profiles = [
                self._profile(inner, rhs, places, sizes, i) for i in range(len(members))
            ]
            if sizes == before and len(members) > 1:
                break
        wide = [float(priors.SIZES[i]) for i in sizes]
        score, mean, covariance = _posterior_at_sizes(
            inner, rhs, self._sizes_by_column(wide, places)
        )
        score += sum(float(DENSITY[i]) for i in sizes)
        score += sum(float(np.logaddexp.reduce(p - p.max())) for p in profiles)
        return EffectSetPosterior(tuple(members), tuple(wide), score, mean, covariance)

    def evidence_gain(self, base: EffectSetPosterior, member: LevelEffect) -> float:
        """Log evidence that a further effect adds to a set whose sizes are fixed."""
        if not base.effects:
            blocks = self._blocks(member)
            gain = evidence_gains(*blocks, _largest_diagonal(blocks[0])).sum(axis=0)
            return float(np.logaddexp.reduce(gain + DENSITY))
        every = [*base.effects, member]
        inner, rhs, places = self._combined_blocks(every)
        known = np.repeat(base.sizes, [m.width for m in base.effects])
        gain = _evidence_gain(inner, rhs, places[-1], known)
        return float(np.logaddexp.reduce(gain + DENSITY))

    def _blocks(self, member: LevelEffect) -> tuple[Array, Array]:
        """G and b of a single effect, (groups, k, k) and (groups, k)."""
        k, count = len(member.columns), len(member.grouping.labels)
        inner, rhs = np.zeros((count, k, k)), np.zeros((count, k))
        at = member.columns
        np.add.at(inner, member.grouping.index, self.matrix[:, at[:, None], at])
        np.add.at(rhs, member.grouping.index, self.rhs[:, at])
        return inner, rhs

    def _combined_blocks(
        self, members: Sequence[LevelEffect]
    ) -> tuple[Array, Array, list[slice]]:
        """G and b of (1), and the rows of each effect in them."""
        ends = np.cumsum([0, *(m.width for m in members)]).tolist()
        places = [slice(a, b) for a, b in pairwise(ends)]
        inner, rhs = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1])
        for one, here in zip(members, places, strict=True):
            rows, k = one.grouping.index, len(one.columns)
            np.add.at(rhs[here].reshape(-1, k), rows, self.rhs[:, one.columns])
            for other, there in zip(members, places, strict=True):
                j = len(other.columns)
                part = np.zeros((one.width // k, other.width // j, k, j))
                each = self.matrix[:, one.columns[:, None], other.columns]
                np.add.at(part, (rows, other.grouping.index), each)
                inner[here, there] = part.transpose(0, 2, 1, 3).reshape(
                    one.width, other.width
                )
        return inner, rhs, places

    @staticmethod
    def _sizes_by_column(wide: Sequence[float], places: Sequence[slice]) -> Array:
        parts = [
            np.full(p.stop - p.start, w) for w, p in zip(wide, places, strict=True)
        ]
        return np.concatenate([np.empty(0), *parts])

    def _profile(
        self,
        inner: Array,
        rhs: Array,
        places: Sequence[slice],
        sizes: list[int],
        i: int,
    ) -> Array:
        """Log evidence over the sizes of effect i; sizes[i] is set to the best one."""
        others = np.ones(len(rhs), dtype=bool)
        others[places[i]] = False
        order = np.concatenate([np.flatnonzero(others), np.flatnonzero(~others)])
        wide = self._sizes_by_column([float(priors.SIZES[s]) for s in sizes], places)[
            others
        ]
        last = slice(int(others.sum()), len(rhs))
        gain = _evidence_gain(inner[np.ix_(order, order)], rhs[order], last, wide)
        profile: Array = gain + DENSITY
        sizes[i] = int(np.argmax(profile))
        return profile


def _evidence_gain(inner: Array, rhs: Array, last: slice, wide: Array) -> Array:
    """Gain in log evidence for each size of the last columns.

    The columns before them have fixed sizes `wide` (a,).
    """
    first = slice(0, last.start)
    scaled = inner[first, first] * wide * wide[:, None] + np.eye(last.start)
    right = np.column_stack([inner[first, last], rhs[first]]) * wide[:, None]
    solved = np.linalg.solve(scaled, right)
    left = inner[last, first] * wide
    own = inner[last, last]
    less = own - left @ solved[:, :-1]
    gain: Array = evidence_gains(
        less, rhs[last] - left @ solved[:, -1], _largest_diagonal(own)
    )
    return gain


def _largest_diagonal(inner: Array) -> Array:
    """Largest diagonal element of matrices (..., k, k)."""
    largest: Array = np.diagonal(inner, 0, -2, -1).max(axis=-1, initial=0.0)
    return largest


def _posterior_at_sizes(
    inner: Array, rhs: Array, wide: Array
) -> tuple[float, Array, Array]:
    """Log evidence (2), mean (a,) and covariance (a, a) at sizes `wide` (a,)."""
    scaled = inner * wide * wide[:, None] + np.eye(len(wide))
    root = np.linalg.cholesky(scaled)
    half = np.linalg.solve(root, np.diag(wide))
    seen = half @ rhs
    score = 0.5 * float(seen @ seen) - float(np.log(np.diag(root)).sum())
    return score, half.T @ seen, half.T @ half
