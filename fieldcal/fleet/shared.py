"""Search for the effects that sessions share, and the level of each.

A set of effects, each at a level, is weighed by its evidence (`levels`) times the prior
probability of each effect. The search adds an effect, removes one or moves one to
another level, one at a time. Probabilities are the weights of all sets that were
evaluated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.fleet.levels import (
    EffectSetPosterior,
    Grouping,
    LevelEffect,
    PooledSessions,
    groupings,
)
from fieldcal.fleet.reduced import ReducedSession, SharedColumn
from fieldcal.history.filters import LEVELS
from fieldcal.history.sessions import StoredSession
from fieldcal.model import priors, thresholds

FOLLOWED = 4
"""Number of candidates that are evaluated in full at each step."""

MAX_STEPS = 8
"""Largest number of steps of a search."""

EffectKey = tuple[str, str]
"""Id of an effect, and triad."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedEffect:
    """An effect at a level: a candidate of the search.

    Attributes
    ----------
    key : id of the effect, and triad
    shape : time constant, empty if there is none
    columns : its parameters
    level_effect : columns of the effect, and groups of the level
    log_chance : ln of the prior probability that sessions have the effect
    log_share : ln of the part of this shape and level among all shapes and levels

    """

    key: EffectKey
    shape: str
    columns: tuple[SharedColumn, ...]
    level_effect: LevelEffect
    log_chance: float
    log_share: float


@dataclass(frozen=True, slots=True)
class SharedFinding:
    """An effect of the best set.

    Attributes
    ----------
    effect : effect and level
    probability : posterior probability of the effect, at any level
    level_probability : posterior probability of the effect at this level
    alternatives : effects and levels that explain the sessions as well
    values, sigmas : (groups, k) of its parameters, in their units

    """

    effect: SharedEffect
    probability: float
    level_probability: float
    alternatives: tuple[str, ...]
    values: Array
    sigmas: Array

    @property
    def level(self) -> str:
        """Name of the level; several if they group the sessions alike."""
        return " or ".join(self.effect.level_effect.grouping.names)

    def to_json(self) -> dict[str, Any]:
        """Return it as an object."""
        name, part = self.effect.key
        groups = self.effect.level_effect.grouping.labels
        return {
            "id": name,
            "part": part or None,
            "shape": self.effect.shape or None,
            "level": list(self.effect.level_effect.grouping.names),
            "probability": self.probability,
            "level_probability": self.level_probability,
            "or": list(self.alternatives),
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
    sessions : stored sessions, each reduced and with its levels

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
        tables = [_level_labels(one) for one in sessions]
        self.groupings = groupings(tables, ("device", *LEVELS, "session"))
        columns, matrix, rhs = stack_sessions(some)
        self.sessions = PooledSessions(matrix, rhs)
        self.candidates = list(self._candidates(columns))
        self.candidates += _unexplained_effects(columns, matrix, self.groupings)
        self.visited: dict[frozenset[int], tuple[float, EffectSetPosterior]] = {}

    def _candidates(self, columns: Sequence[SharedColumn]) -> list[SharedEffect]:
        parts: dict[EffectKey, dict[tuple[str, int], list[int]]] = {}
        for i, c in enumerate(columns):
            for variant in () if c.own else c.variants:
                every = parts.setdefault((c.effect, c.part), {})
                every.setdefault((c.shape, variant), []).append(i)
        return [
            SharedEffect(
                key,
                shape,
                tuple(columns[i] for i in at),
                LevelEffect(np.array(at, dtype=np.intp), level),
                float(np.log(columns[at[0]].chance)),
                -float(np.log(len(every) * len(self.groupings))),
            )
            for key, every in parts.items()
            for (shape, _), at in every.items()
            for level in self.groupings
        ]

    def score(self, some: frozenset[int]) -> float:
        """Score of a set of candidates: log evidence plus ln of the prior."""
        if some not in self.visited:
            order = sorted(some)
            effects = [self.candidates[i] for i in order]
            found = self.sessions.posterior([e.level_effect for e in effects])
            self.visited[some] = (found.score + self._log_prior(effects), found)
        return self.visited[some][0]

    @staticmethod
    def _log_prior(effects: Sequence[SharedEffect]) -> float:
        names: set[str] = set()
        total = 0.0
        for one in effects:
            again = one.key[0] in names and not one.columns[0].own
            total += float(np.log(priors.COMPANION_CHANCE)) if again else one.log_chance
            total += one.log_share
            names.add(one.key[0])
        return total

    def run(self) -> list[SharedFinding]:
        """Return the effects that are probable at their level, the surest first."""
        best = frozenset[int]()
        self.score(best)
        for _ in range(MAX_STEPS):
            better = max([best, *self._neighbouring_sets(best)], key=self.score)
            if better == best:
                break
            best = better
        for i in best:
            for other in self._ranked_candidates(best - {i})[:FOLLOWED]:
                self.score(best - {i} | {other})
        found = [self._finding(best, i) for i in best]
        found = [
            one for one in found
            if one.level_probability > thresholds.NAMED
            and not one.effect.columns[0].own
        ]  # fmt: skip
        return sorted(found, key=lambda one: -one.level_probability)

    def _neighbouring_sets(self, best: frozenset[int]) -> list[frozenset[int]]:
        """Sets with one effect more, one less, or one at another level."""
        found = [best | {i} for i in self._ranked_candidates(best)[:FOLLOWED]]
        for i in best:
            found.append(best - {i})
            one = self.candidates[i]
            for j, other in enumerate(self.candidates):
                if j not in best and other.columns == one.columns:
                    found.append(best - {i} | {j})
        return found

    def _ranked_candidates(self, base: frozenset[int]) -> list[int]:
        """Candidates that are not in a set, by the score that each would give it."""
        self.score(base)
        found = self.visited[base][1]
        scores = {
            i: self.sessions.evidence_gain(found, one.level_effect)
            + one.log_chance
            + one.log_share
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
        level = one.level_effect.grouping
        here = [
            s for s in has if any(self._is_effect_at_level(j, name, level) for j in s)
        ]
        typical = np.array([c.typical for c in one.columns])
        values, sigmas = self.visited[best][1].effect_values(sorted(best).index(i))
        return SharedFinding(
            one,
            float(sum(weight[s] for s in has) / sum(weight.values())),
            float(sum(weight[s] for s in here) / sum(weight.values())),
            tuple(self._alternatives(best, i)),
            values * typical,
            sigmas * typical,
        )

    def _is_effect_at_level(self, j: int, name: str, level: Grouping) -> bool:
        other = self.candidates[j]
        return other.key[0] == name and other.level_effect.grouping is level

    def _alternatives(self, best: frozenset[int], i: int) -> list[str]:
        """Effects and levels that explain the sessions as well in place of effect i."""
        own, found = self.visited[best][0], dict[str, None]()
        one = self.candidates[i]
        for j, other in enumerate(self.candidates):
            there = best - {i} | {j}
            if j in best or there not in self.visited:
                continue
            if self.visited[there][0] > own - thresholds.ALIAS_LOG_MARGIN:
                level = " or ".join(other.level_effect.grouping.names)
                if (other.key, other.level_effect.grouping) != (
                    one.key,
                    one.level_effect.grouping,
                ):
                    found[f"{other.key[0]} of {level}"] = None
        return list(found)


def _unexplained_effects(
    columns: Sequence[SharedColumn], matrix: Array, levels: Sequence[Grouping]
) -> Iterator[SharedEffect]:
    """Smooth functions that no effect makes, as candidates at the level "session"."""
    sessions = next(level for level in levels if "session" in level.names)
    parts: dict[EffectKey, list[int]] = {}
    for i, c in enumerate(columns):
        if c.own:
            parts.setdefault((c.effect, c.part), []).append(i)
    for key, at in parts.items():
        having = int((matrix[:, at, at] > 0).any(axis=1).sum())
        first = columns[at[0]]
        yield SharedEffect(
            key, "", tuple(columns[i] for i in at),
            LevelEffect(np.array(at, dtype=np.intp), sessions),
            having * float(np.log(first.chance)), 0.0,
        )  # fmt: skip


def stack_sessions(
    some: Sequence[ReducedSession],
) -> tuple[list[SharedColumn], Array, Array]:
    """Columns of all sessions, with M (s, k, k) and q (s, k), zero where absent.

    A column with a time constant is used only if all sessions with the effect have it:
    in the others the effect may be present at another time constant.
    """
    every: dict[tuple[str, str, str, str], SharedColumn] = {}
    having: dict[tuple[str, str], int] = {}
    count: dict[tuple[str, str, str, str], int] = {}
    for one in some:
        for key in {(c.effect, c.part) for c in one.columns}:
            having[key] = having.get(key, 0) + 1
        for c in one.columns:
            every.setdefault(_column_key(c), c)
            count[_column_key(c)] = count.get(_column_key(c), 0) + 1
    names = [
        key for key, c in every.items()
        if not c.shape or count[key] == having[c.effect, c.part]
    ]  # fmt: skip
    place = {key: i for i, key in enumerate(names)}
    matrix = np.zeros((len(some), len(names), len(names)))
    rhs = np.zeros((len(some), len(names)))
    for s, one in enumerate(some):
        own = [i for i, c in enumerate(one.columns) if _column_key(c) in place]
        at = [place[_column_key(one.columns[i])] for i in own]
        matrix[s][np.ix_(at, at)] = one.matrix[np.ix_(own, own)]
        rhs[s, at] = one.rhs[own]
    return [every[key] for key in names], matrix, rhs


def _column_key(c: SharedColumn) -> tuple[str, str, str, str]:
    return (c.effect, c.part, c.shape, c.name)


def _level_labels(one: StoredSession) -> Mapping[str, str]:
    """Label of a session at each level."""
    return {"device": one.serial, **one.levels, "session": one.folder}
