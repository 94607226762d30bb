"""The state at the estimate of a set: the nominal state, changed by its columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.state import State, Term
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.physics.effect import Motion, Sensor


def state_at_estimate(
    dictionary: Dictionary, nominal: State, fitted: Set
) -> tuple[State, Array]:
    """The state at a set's estimate, and the values of all columns, (k,), in it."""
    d = dictionary
    kept = np.zeros(d.width, dtype=bool)
    kept[columns_in_state(d, fitted.members)] = True
    if d.unoriented.any():
        kept[d.rotations] = True
    values = np.where(kept, estimates_by_column(fitted.state, d), 0.0)
    terms = [Term(t.effect, t.values, t.shape, t.origin) for t in nominal.terms]
    state = State(
        nominal.bias + values[d.bias : d.bias + 6],
        nominal.scale + values[d.scale : d.scale + 6],
        values[d.rotations].reshape(-1, 2),
        values[d.earth : d.earth + 3] if d.earth >= 0 else np.zeros(3),
        (*terms, *_effect_terms(fitted, values)),
        *_attitude_errors(d, values),
    )
    return state, values


def columns_in_state(dictionary: Dictionary, members: Sequence[Member]) -> Index:
    """Columns of permanent groups and members whose estimates the state contains."""
    groups = [*dictionary.always, *(g for _, g in members)]
    return np.concatenate([g.columns for g in groups if g.in_state])


def _effect_terms(fitted: Set, values: Array) -> Iterator[Term]:
    """Effects of a set with their estimated parameters."""
    for _, group in fitted.members:
        if isinstance(group.effect, Motion | Sensor):
            parameters = np.zeros(len(group.effect.params))
            parameters[list(group.params)] = values[group.columns]
            yield Term(group.effect, parameters, group.shape, group.origin)


def _attitude_errors(dictionary: Dictionary, values: Array) -> Iterator[Array]:
    """Errors of measured attitudes, (p, 3), if there are any."""
    d = dictionary
    if d.attitude >= 0:
        yield values[d.attitude : d.attitude + 3 * d.position_count].reshape(-1, 3)
