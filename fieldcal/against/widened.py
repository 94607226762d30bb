"""What was found in a session, together with causes that another session has.

The columns of what only the other has are put beside the best set, with the shape that
they have there, so that both sessions are asked the same questions: what each cause is
here and how well that is known, everything else of the session eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.against.joint import EffectTold
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import EVEN, Member, Sizes
from fieldcal.model.posterior.reported import reported
from fieldcal.model.search.inference import Inference
from fieldcal.model.search.selection import Search
from fieldcal.model.system.linear_rows import Linear


@dataclass(frozen=True)
class Widened:
    """A set of causes in one session.

    Attributes
    ----------
    inference : with a dictionary that has their columns
    search : about the state of the explanation
    set : the causes
    told_from : the set as its numbers are taken
    linear : rows of each channel about that
    values : (k,) of the dictionary's columns in the state

    """

    inference: Inference
    search: Search
    set: Set
    told_from: Set
    linear: Sequence[Linear]
    values: Array

    @property
    def observed(self) -> Index:
        """Channels that say something."""
        return self.inference.dictionary.observed

    def member(self, key: str) -> Member | None:
        """A cause by its key, with its variant."""
        return next((m for m in self.set.members if m[0].key == key), None)

    def told(self, key: str) -> EffectTold | None:
        """What the session says of a cause, all else eliminated; None without it."""
        if (member := self.member(key)) is None:
            return None
        columns, typical = member[1].columns, member[1].typical
        state = self.set.state
        kept = np.ones(len(state.columns), dtype=bool)
        kept[_places(state.columns, columns)] = False
        less = Eliminated.of(state.rows, state.columns[kept], state.sizes[kept])
        inner, pull = less.rest(columns, typical)
        own = np.diag(state.rows.matrix(columns, columns)) * typical**2
        return EffectTold(inner, pull, float(own.max()), self.evidence(key))

    def evidence(self, key: str) -> float:
        """Rise of ln Z with a cause, its chance not counted."""
        rest = tuple(m for m in self.set.members if m[0].key != key)
        less = self.search.evaluated(rest, Search.sizes_of(self.set, rest))
        found = self.set.score - self.search.chance(self.set.members)
        return float(found - less.score + self.search.chance(rest))

    def estimate(self, columns: Index) -> tuple[Array, Array]:
        """Values and covariance of some columns of the set."""
        state = self.told_from.state
        at = _places(state.columns, columns)
        return state.estimate[at], state.inverse[np.ix_(at, at)]


def _places(columns: Index, wanted: Index) -> Index:
    """Where columns stand in a set; a member's come last."""
    found = [int(np.flatnonzero(columns == c)[-1]) for c in wanted]
    return np.array(found, dtype=np.intp)


def widened(
    explanation: Explanation,
    members: Sequence[Member],
    others: Sequence[Member],
    later: float,
) -> Widened:
    """A session's own causes, with those that only another has.

    Parameters
    ----------
    explanation : of this session
    members : its own causes
    others : those of the other session, with their variants there
    later : what this session's clock is ahead of the other's, s

    """
    found = explanation.inferred
    own = Inference(found.inference.system.apart(), found.inference.nominal)
    own.turned = list(found.turned)
    every = list(members)
    for cause, group in others:
        if (more := _counterpart(own, cause, group, later)) is not None:
            every.append(more)
    values = np.pad(found.values, (0, own.dictionary.width - len(found.values)))
    wanted = own.wanted([*every, *map(on_all_axes, every)]) | (values != 0)
    linear = own.system.linearised(found.state, wanted)
    search = Search(own.dictionary, own.gram_of(linear, values, wanted))
    there = search.evaluated(tuple(every), _start(found.best, every))
    return Widened(own, search, there, reported(search, there), linear, values)


def on_all_axes(member: Member) -> Member:
    """The same effect with all its parameters.

    A device has it on every axis. Where positions do not distinguish it from bias and
    scale factor on some axes, it was found on the others alone.
    """
    cause, group = member
    same = [*group.siblings(cause.variants), group]
    if group.effect is None:
        return member
    return cause, max(same, key=lambda v: len(v.params))


def _start(best: Set, every: Sequence[Member]) -> Sizes:
    """Sizes to begin with: those of the best set where it has the cause."""
    known = {m[0].key: s for m, s in zip(best.members, best.sizes.members, strict=True)}
    sizes = tuple(known.get(c.key, EVEN) for c, _ in every)
    return Sizes(best.sizes.calibration, best.sizes.instability, sizes)


def _counterpart(
    own: Inference, cause: Cause, group: Group, later: float
) -> Member | None:
    """The cause here that is what another session calls so; None if it has none."""
    here = next((c for c in own.dictionary.causes if c.key == cause.key), None)
    if here is None:
        return None
    alike = [v for v in here.variants if v.params == group.params] or here.variants
    if cause.kind in ("position", "unknown"):
        alike = [v for v in alike if v.position == group.position] or alike
    if group.effect is None or not group.shape:
        same = [v for v in alike if dict(v.shape) == dict(group.shape)]
        return here, (same or list(alike))[0]
    (shape,) = group.effect.shapes
    at = group.shape[shape.name] + (later if shape.kind == "instant" else 0.0)
    near = min(
        alike, key=lambda v: (v.origin != group.origin, abs(v.shape[shape.name] - at))
    )
    here, (exact,) = own.dictionary.refined(here, near, [at])
    own.turned = [t.copied(near.columns, exact.columns) for t in own.turned]
    return here, exact
