"""Which effects sessions share, and at which level: the search, and what it says.

Sets of effects, each at a level, are weighed by evidence (`levels`) times the chance of
each effect; the best is found by adding, leaving out and putting at another level one
at a time. Probabilities are the weights of all sets that were looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.fleet.levels import Grouping, Member, Sessions, WeighedMembers, groupings
from fieldcal.fleet.reduced import ReducedSession, SharedColumn
from fieldcal.history.sessions import LEVELS, StoredSession
from fieldcal.model import priors, thresholds

FOLLOWED = 4
"""Effects that are weighed in full at each step."""

MOST = 8
"""Steps of one search."""

Key = tuple[str, str]
"""Effect and triad."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedEffect:
    """An effect that may be shared.

    Attributes
    ----------
    key : effect and triad
    shape : time constant, empty where there is none
    columns : its parameters
    member : at a level
    chance : that sessions have it, ln
    among : of this shape and level among all, ln

    """

    key: Key
    shape: str
    columns: tuple[SharedColumn, ...]
    member: Member
    chance: float
    among: float


@dataclass(frozen=True, slots=True)
class SharedFinding:
    """An effect of the best set.

    Attributes
    ----------
    effect : what, and at which level
    probability : that the sessions have it, at whatever level
    level_probability : that they have it at this level
    other : levels and effects that the sessions do not tell from it
    values, sigmas : (groups, k) of its parameters, in their units

    """

    effect: SharedEffect
    probability: float
    level_probability: float
    other: tuple[str, ...]
    values: Array
    sigmas: Array

    @property
    def level(self) -> str:
        """Name of the level; several where no session tells them apart."""
        return " or ".join(self.effect.member.grouping.names)

    def to_json(self) -> dict[str, Any]:
        """Return it as an object."""
        name, part = self.effect.key
        groups = self.effect.member.grouping.labels
        return {
            "id": name,
            "part": part or None,
            "shape": self.effect.shape or None,
            "level": list(self.effect.member.grouping.names),
            "probability": self.probability,
            "level_probability": self.level_probability,
            "or": list(self.other),
            "groups": {
                label: [
                    {"name": c.name, "value": v, "sigma": s, "unit": c.unit}
                    for c, v, s in zip(self.effect.columns, row, wide, strict=True)
                ]
                for label, row, wide in zip(
                    groups, self.values.tolist(), self.sigmas.tolist(), strict=True
                )
            },
        }


class SharedSearch:
    """The search among effects and levels.

    Parameters
    ----------
    sessions : with their reduced rows and what they have in common

    """

    def __init__(self, sessions: Sequence[StoredSession]) -> None:
        some = [
            ReducedSession.from_bytes(one.reduced) for one in sessions if one.reduced
        ]
        if len(some) < len(sessions):
            bad = next(one.folder for one in sessions if not one.reduced)
            raise InputError(
                f"{bad}: has no rows to be shared, since it cannot be examined; see"
                " fieldcal solve, or leave it out"
            )
        tables = [_table(one) for one in sessions]
        self.groupings = groupings(tables, ("device", *LEVELS, "session"))
        columns, matrix, pull = together(some)
        self.sessions = Sessions(matrix, pull)
        self.candidates = list(self._candidates(columns))
        self.candidates += _unexplained(columns, matrix, self.groupings)
        self.visited: dict[frozenset[int], tuple[float, WeighedMembers]] = {}

    def _candidates(self, columns: Sequence[SharedColumn]) -> list[SharedEffect]:
        parts: dict[Key, dict[tuple[str, int], list[int]]] = {}
        for i, c in enumerate(columns):
            for variant in () if c.own else c.variants:
                every = parts.setdefault((c.effect, c.part), {})
                every.setdefault((c.shape, variant), []).append(i)
        return [
            SharedEffect(
                key,
                shape,
                tuple(columns[i] for i in at),
                Member(np.array(at, dtype=np.intp), level),
                float(np.log(columns[at[0]].chance)),
                -float(np.log(len(every) * len(self.groupings))),
            )
            for key, every in parts.items()
            for (shape, _), at in every.items()
            for level in self.groupings
        ]

    def weighed(self, some: frozenset[int]) -> float:
        """Score of a set of candidates: evidence times chance, ln."""
        if some not in self.visited:
            order = sorted(some)
            effects = [self.candidates[i] for i in order]
            found = self.sessions.weighed([e.member for e in effects])
            self.visited[some] = (found.score + self._chance(effects), found)
        return self.visited[some][0]

    @staticmethod
    def _chance(effects: Sequence[SharedEffect]) -> float:
        names: set[str] = set()
        total = 0.0
        for one in effects:
            again = one.key[0] in names and not one.columns[0].own
            total += float(np.log(priors.AGAIN)) if again else one.chance
            total += one.among
            names.add(one.key[0])
        return total

    def run(self) -> list[SharedFinding]:
        """Effects that are likelier there than not at their levels; surest first."""
        best = frozenset[int]()
        self.weighed(best)
        for _ in range(MOST):
            better = max([best, *self._near(best)], key=self.weighed)
            if better == best:
                break
            best = better
        for i in best:
            for other in self._offers(best - {i})[:FOLLOWED]:
                self.weighed(best - {i} | {other})
        found = [self._finding(best, i) for i in best]
        found = [
            one for one in found
            if one.level_probability > thresholds.NAMED
            and not one.effect.columns[0].own
        ]  # fmt: skip
        return sorted(found, key=lambda one: -one.level_probability)

    def _near(self, best: frozenset[int]) -> list[frozenset[int]]:
        """Sets with one more, one less, or one at another level."""
        found = [best | {i} for i in self._offers(best)[:FOLLOWED]]
        for i in best:
            found.append(best - {i})
            one = self.candidates[i]
            for j, other in enumerate(self.candidates):
                if j not in best and other.columns == one.columns:
                    found.append(best - {i} | {j})
        return found

    def _offers(self, base: frozenset[int]) -> list[int]:
        """Candidates beside a set, the best first."""
        self.weighed(base)
        found = self.visited[base][1]
        scores = {
            i: self.sessions.offered(found, one.member) + one.chance + one.among
            for i, one in enumerate(self.candidates)
            if i not in base
        }
        return sorted(scores, key=lambda i: -scores[i])

    def _finding(self, best: frozenset[int], i: int) -> SharedFinding:
        one = self.candidates[i]
        top = max(score for score, _ in self.visited.values())
        weight = {s: np.exp(v - top) for s, (v, _) in self.visited.items()}
        name = one.key[0]
        has = [s for s in weight if any(self.candidates[j].key[0] == name for j in s)]
        level = one.member.grouping
        here = [s for s in has if any(self._is(j, name, level) for j in s)]
        typical = np.array([c.typical for c in one.columns])
        values, sigmas = self.visited[best][1].of(sorted(best).index(i))
        return SharedFinding(
            one,
            float(sum(weight[s] for s in has) / sum(weight.values())),
            float(sum(weight[s] for s in here) / sum(weight.values())),
            tuple(self._instead(best, i)),
            values * typical,
            sigmas * typical,
        )

    def _is(self, j: int, name: str, level: Grouping) -> bool:
        other = self.candidates[j]
        return other.key[0] == name and other.member.grouping is level

    def _instead(self, best: frozenset[int], i: int) -> list[str]:
        """What explains the sessions as well in the place of one effect."""
        own, found = self.visited[best][0], dict[str, None]()
        one = self.candidates[i]
        for j, other in enumerate(self.candidates):
            there = best - {i} | {j}
            if j in best or there not in self.visited:
                continue
            if self.visited[there][0] > own - thresholds.SAME:
                level = " or ".join(other.member.grouping.names)
                if (other.key, other.member.grouping) != (
                    one.key,
                    one.member.grouping,
                ):
                    found[f"{other.key[0]} of {level}"] = None
        return list(found)


def _unexplained(
    columns: Sequence[SharedColumn], matrix: Array, levels: Sequence[Grouping]
) -> Iterator[SharedEffect]:
    """Functions without physics, each of those sessions that had it alone."""
    sessions = next(level for level in levels if "session" in level.names)
    parts: dict[Key, list[int]] = {}
    for i, c in enumerate(columns):
        if c.own:
            parts.setdefault((c.effect, c.part), []).append(i)
    for key, at in parts.items():
        having = int((matrix[:, at, at] > 0).any(axis=1).sum())
        first = columns[at[0]]
        yield SharedEffect(
            key, "", tuple(columns[i] for i in at),
            Member(np.array(at, dtype=np.intp), sessions),
            having * float(np.log(first.chance)), 0.0,
        )  # fmt: skip


def together(some: Sequence[ReducedSession]) -> tuple[list[SharedColumn], Array, Array]:
    """Columns of all sessions, M (s, k, k) and q (s, k); nothing where one has none.

    Of an effect with a time constant only those count that all sessions have that
    have the effect: it may be there at another.
    """
    every: dict[tuple[str, str, str, str], SharedColumn] = {}
    having: dict[tuple[str, str], int] = {}
    count: dict[tuple[str, str, str, str], int] = {}
    for one in some:
        for key in {(c.effect, c.part) for c in one.columns}:
            having[key] = having.get(key, 0) + 1
        for c in one.columns:
            every.setdefault(_key(c), c)
            count[_key(c)] = count.get(_key(c), 0) + 1
    names = [
        key for key, c in every.items()
        if not c.shape or count[key] == having[c.effect, c.part]
    ]  # fmt: skip
    place = {key: i for i, key in enumerate(names)}
    matrix = np.zeros((len(some), len(names), len(names)))
    pull = np.zeros((len(some), len(names)))
    for s, one in enumerate(some):
        own = [i for i, c in enumerate(one.columns) if _key(c) in place]
        at = [place[_key(one.columns[i])] for i in own]
        matrix[s][np.ix_(at, at)] = one.matrix[np.ix_(own, own)]
        pull[s, at] = one.pull[own]
    return [every[key] for key in names], matrix, pull


def _key(c: SharedColumn) -> tuple[str, str, str, str]:
    return (c.effect, c.part, c.shape, c.name)


def _table(one: StoredSession) -> Mapping[str, str]:
    """Level by level, what a session belongs to."""
    return {"device": one.serial, **one.levels, "session": one.folder}
