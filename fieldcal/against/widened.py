"""The best set of a session, widened by the causes of another session.

The columns of causes that only the other session has are added to the best set, with
their shape there. For each cause, both sessions then give its information, with all
other parameters of the session eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.against.joint import EffectInformation
from fieldcal.core.samples import Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import UNIT_INDEX, Member, Sizes
from fieldcal.model.posterior.model_average import average_over_sizes
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.system.linear_rows import LinearRows


@dataclass(frozen=True)
class WidenedSet:
    """A widened set of causes in one session.

    Attributes
    ----------
    fit : with a dictionary that has the columns of all causes
    sets : linearised about the state of the explanation
    set : the causes
    reported_set : the set with the sizes from which estimates are reported
    linear : linearised rows of each channel
    values : (k,) of the dictionary's columns in the state

    """

    fit: GaussNewton
    sets: Sets
    set: Set
    reported_set: Set
    linear: Sequence[LinearRows]
    values: Array

    @property
    def observed(self) -> Index:
        """Channels that were measured."""
        return self.fit.dictionary.observed

    def member(self, key: str) -> Member | None:
        """The member of the set with this key; None without it."""
        return next((m for m in self.set.members if m[0].key == key), None)

    def effect_information(self, key: str) -> EffectInformation | None:
        """Information about a cause, all else eliminated; None without it."""
        if (member := self.member(key)) is None:
            return None
        columns, typical = member[1].columns, member[1].typical
        found = _information(_less(self.set.state, columns), columns, typical)
        return replace(found, evidence=self.evidence(key))

    def information_beside_calibration(self, key: str) -> EffectInformation | None:
        """The same, while the calibration may be that of any device of its grade."""
        if (member := self.member(key)) is None:
            return None
        columns, typical = member[1].columns, member[1].typical
        return _information(_less(self.reported_set.state, columns), columns, typical)

    def beside_effect(self, key: str, columns: Index) -> tuple[Array, Array, Array]:
        """Some columns (k,) without an effect, and how it changes them.

        Returns
        -------
        values (k,), covariance (k, k), and slope (k, m): by how much the values are
        less with one typical size of each parameter; (k, 0) without the effect

        """
        member = self.member(key)
        effect = member[1].columns if member else np.zeros(0, dtype=np.intp)
        less = _less(self.reported_set.state, effect)
        at = less.places_of(columns)
        slope = less.inverse[at] @ less.rows.matrix(less.columns, effect)
        scaled = slope * member[1].typical if member else slope
        return less.estimate[at], less.inverse[np.ix_(at, at)], scaled

    def evidence(self, key: str) -> float:
        """Rise of ln Z with a cause, without its prior probability."""
        less = self.without(key).set
        found = self.set.score - self.sets.set_log_prior(self.set.members)
        return float(found - less.score + self.sets.set_log_prior(less.members))

    def without(self, key: str) -> WidenedSet:
        """The session without a cause; itself, if it has none of this key."""
        rest = tuple(m for m in self.set.members if m[0].key != key)
        if len(rest) == len(self.set.members):
            return self
        return self.having(self.sets.reduced(self.set, rest))

    def having(self, found: Set) -> WidenedSet:
        """The session with another set of causes, and its estimates with these."""
        return replace(
            self, set=found, reported_set=average_over_sizes(self.sets, found)
        )

    def estimate(self, columns: Index) -> tuple[Array, Array]:
        """Values and covariance of some columns of the set."""
        state = self.reported_set.state
        at = state.places_of(columns)
        return state.estimate[at], state.inverse[np.ix_(at, at)]


def _less(state: Eliminated, columns: Index) -> Eliminated:
    """A state without some columns, at the sizes that it has."""
    kept = np.ones(len(state.columns), dtype=bool)
    kept[state.places_of(columns)] = False
    return Eliminated.of(state.rows, state.columns[kept], state.prior_sigma[kept])


def _information(less: Eliminated, columns: Index, typical: Array) -> EffectInformation:
    inner, rhs = less.schur_complement(columns, typical)
    own = np.diag(less.rows.matrix(columns, columns)) * typical**2
    return EffectInformation(inner, rhs, float(own.max()))


def widen_set(
    explanation: Explanation,
    members: Sequence[Member],
    others: Sequence[Member],
    later: float,
) -> WidenedSet:
    """Widen a session's own causes by those that only the other session has.

    Parameters
    ----------
    explanation : of this session
    members : its own causes
    others : those of the other session, with their variants there
    later : time by which this session's clock is ahead of the other's, s

    """
    found = explanation.inferred
    own = found.independent_fit()
    every = list(members)
    for cause, group in others:
        if (more := _counterpart(own, cause, group, later)) is not None:
            every.append(more)
    values = np.pad(found.values, (0, own.dictionary.width - len(found.values)))
    wanted = own.wanted_columns([*every, *map(with_all_parameters, every)]) | (
        values != 0
    )
    linear = own.system.linearised(found.state, wanted)
    sets = Sets(own.dictionary, own.gram_of(linear, values, wanted))
    there = sets.evaluate(tuple(every), _starting_sizes(found.best, every))
    return WidenedSet(own, sets, there, average_over_sizes(sets, there), linear, values)


def with_all_parameters(member: Member) -> Member:
    """The member with all parameters of its effect.

    A device has an effect on every axis. If positions do not distinguish it from bias
    and scale factor on some axes, it was found on the others alone.
    """
    cause, group = member
    same = [*group.with_same_shape(cause.variants), group]
    if group.effect is None:
        return member
    return cause, max(same, key=lambda v: len(v.params))


def _starting_sizes(best: Set, every: Sequence[Member]) -> Sizes:
    """Initial sizes: those of the best set where it has the cause."""
    known = {m[0].key: s for m, s in zip(best.members, best.sizes.members, strict=True)}
    sizes = tuple(known.get(c.key, UNIT_INDEX) for c, _ in every)
    return Sizes(best.sizes.calibration, best.sizes.instability, sizes)


def _counterpart(
    own: GaussNewton, cause: Cause, group: Group, later: float
) -> Member | None:
    """The cause of this session that corresponds to one of another; None without it."""
    here = next((c for c in own.dictionary.causes if c.key == cause.key), None)
    if here is None:
        return None
    alike = [v for v in here.variants if v.params == group.params] or here.variants
    if cause.kind in ("position", "unknown"):
        alike = [v for v in alike if v.position == group.position] or alike
    if group.effect is None or not group.shape:
        same = [v for v in alike if dict(v.shape) == dict(group.shape)]
        return here, (same or list(alike))[0]
    instants = {s.name for s in group.effect.shapes if s.is_instant}
    at = {k: v + later * (k in instants) for k, v in group.shape.items()}
    there = replace(group, shape=at)
    near = min(alike, key=lambda v: (v.origin != group.origin, there.shape_distance(v)))
    here, (exact,) = own.dictionary.add_shapes(here, near, [at])
    own.copy_turn_columns(near, exact)
    return here, exact
