"""The base state at the estimate of a set, by iterated linearisation.

It is the nominal state, changed by the set's columns. Source: Gauss and Newton.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import priors, tolerances
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.state import State, Term
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import System, gram
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.turns.turn import Turn
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
    return state_with_values(d, nominal, fitted.members, values), values


def state_with_values(
    dictionary: Dictionary, nominal: State, members: Sequence[Member], values: Array
) -> State:
    """The nominal state, changed by values (k,) of all columns, of a set's members."""
    d = dictionary
    measured = 3 * d.position_count if d.attitude >= 0 else 0
    return State(
        nominal.bias + values[d.bias : d.bias + 6],
        nominal.scale + values[d.scale : d.scale + 6],
        values[d.rotations].reshape(-1, 2),
        values[d.earth : d.earth + 3] if d.earth >= 0 else np.zeros(3),
        (*nominal.terms, *_effect_terms(members, values)),
        values[max(d.attitude, 0) :][:measured].reshape(-1, 3),
    )


def columns_in_state(dictionary: Dictionary, members: Sequence[Member]) -> Index:
    """Columns of permanent groups and members whose estimates the state contains."""
    groups = [*dictionary.always, *(g for _, g in members)]
    return np.concatenate([g.columns for g in groups if g.in_state])


def _effect_terms(members: Sequence[Member], values: Array) -> Iterator[Term]:
    """Effects of a set's members with their estimated parameters."""
    for _, group in members:
        if isinstance(group.effect, Motion | Sensor):
            parameters = np.zeros(len(group.effect.params))
            parameters[list(group.params)] = values[group.columns]
            yield Term(group.effect, parameters, group.shape, group.origin)


class GaussNewton:
    """Linearises the rows of a session about states, and fits sets.

    Parameters
    ----------
    system : rows and their dictionary
    nominal : nominal state
    turns : makes the rows of turns; None if there are no turns

    Attributes
    ----------
    turn_rows : rows of the turns about the state where they were last linearised

    """

    def __init__(
        self, system: System, nominal: State, turns: Turns | None = None
    ) -> None:
        self.system, self.nominal, self.turns = system, nominal, turns
        self.dictionary: Dictionary = system.dictionary
        self.turn_rows: list[TurnRows] = []

    def independent_copy(self, turn_rows: Sequence[TurnRows]) -> GaussNewton:
        """A copy to which columns can be added; it keeps the given rows of turns."""
        fit = GaussNewton(self.system.independent_copy(), self.nominal)
        fit.turn_rows = list(turn_rows)
        return fit

    def continuing_copy(self) -> GaussNewton:
        """A copy that also linearises the turns, to which columns can be added."""
        fit = self.independent_copy(self.turn_rows)
        if self.turns is not None:
            fit.turns = self.turns.with_dictionary(fit.dictionary)
        return fit

    def pad(self, values: Array) -> Array:
        """Values of columns, padded with zeros for columns that were added since."""
        return np.pad(values, (0, self.dictionary.width - len(values)))

    def wanted_columns(self, members: Sequence[Member]) -> Mask:
        """Columns of a set, permanent groups, and rotations of unknown orientations."""
        d = self.dictionary
        wanted = np.zeros(d.width, dtype=bool)
        for group in [*d.always, *d.unfitted, *(g for _, g in members)]:
            wanted[group.columns] = True
        if d.unoriented.any():
            wanted[d.rotations] = True
        return wanted

    def gram(self, state: State, values: Array, known: Set | None) -> Gram:
        """Gram matrix of all rows and columns about a state."""
        values = self.pad(values)
        linear = self.system.linearised(state)
        if self.turns is not None:
            self.turn_rows = self.turns.linearised(state, values, linear, known)
        return gram(linear, self.dictionary, values, self.turn_rows)

    def gram_of(
        self, linear: Sequence[LinearRows], values: Array, wanted: Mask
    ) -> Gram:
        """Gram matrix of some columns from linearised rows, with the current turns."""
        columns = np.flatnonzero(wanted)
        return gram(linear, self.dictionary, self.pad(values), self.turn_rows, columns)

    def sets_with_columns_of(
        self, state: State, values: Array, candidates: Sequence[tuple[Member, ...]]
    ) -> Sets:
        """Sets over the rows about a state, with only the columns of some sets."""
        values = self.pad(values)
        wanted = values != 0
        for members in candidates:
            wanted = wanted | self.wanted_columns(members)
        linear = self.system.linearised(state, wanted)
        return Sets(self.dictionary, self.gram_of(linear, values, wanted))

    def settle(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        sizes: Sizes | None = None,
    ) -> tuple[State, Array, Set]:
        """The state at the estimate of a set, by Gauss and Newton, and that set."""
        _, before, settled = self.approach(state, values, members, sizes)
        return *self._step_towards(settled, before), settled

    def approach(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        sizes: Sizes | None = None,
    ) -> tuple[State, Array, Set]:
        """A state as near to the estimate of a set as counts, and the set about it."""
        there = self._near_set_angles(state, self.pad(values), members)
        for _ in range(tolerances.MAX_RELINEARISATIONS):
            state, values = there
            settled, _ = self.estimate(state, values, members, sizes)
            sizes = settled.sizes
            there = self._step_towards(settled, values)
            if self.largest_step(settled, values, there[1]) < tolerances.CONVERGED:
                break
        return state, values, settled

    def estimate(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        sizes: Sizes | None = None,
    ) -> tuple[Set, list[LinearRows]]:
        """A set over the rows linearised about a state, and these rows."""
        wanted = self.wanted_columns(members) | (values != 0)
        linear = self.system.linearised(state, wanted)
        rows = self.gram_of(linear, values, wanted)
        return Sets(self.dictionary, rows).evaluate(members, sizes), linear

    def _near_set_angles(
        self, state: State, values: Array, members: Sequence[Member]
    ) -> tuple[State, Array]:
        """The state with new members that are angles begun near where they are."""
        new = [g for c, g in members if c.position >= 0 and not values[g.columns].any()]
        angles = [self.system.starting_angles(self.nominal, g.position) for g in new]
        if not any(angle.any() for angle in angles):
            return state, values
        values, small = values.copy(), state.small_rotation.copy()
        for group, angle in zip(new, angles, strict=True):
            values[group.columns] = small[group.position] = angle
        return replace(state, small_rotation=small), values

    def _step_towards(self, fitted: Set, before: Array) -> tuple[State, Array]:
        """The state at a set's estimate, or on the way there if that is far off.

        `before` (k,) are the columns' values where the rows were linearised. Without
        its limits the way of an estimate that rows contradict has no end.
        """
        d = self.dictionary
        state, values = self.state_at_estimate(fitted)
        most = priors.FREE_SIZE * d.typical
        most[d.rotations] = priors.SMALL_ROTATION
        beyond = float((np.abs(values - before) / most).max())
        if beyond <= 1.0:
            return state, values
        values = before + (values - before) / beyond
        return state_with_values(d, self.nominal, fitted.members, values), values

    def state_at_estimate(self, fitted: Set) -> tuple[State, Array]:
        """The state at a set's estimate, and its columns' values."""
        return state_at_estimate(self.dictionary, self.nominal, fitted)

    def largest_step(self, fitted: Set, before: Array, values: Array) -> float:
        """Largest change of the state's parameters, in their standard deviations."""
        error = np.sqrt(np.maximum(np.diag(fitted.state.inverse), 1e-300))
        step = np.abs(values - self.pad(before))[fitted.state.columns] / error
        in_state = columns_in_state(self.dictionary, fitted.members)
        counted = np.isin(fitted.state.columns, in_state)
        return float(step[counted].max(initial=0.0))

    def variants_near(
        self, cause: Cause, group: Group, shapes: Sequence[Mapping[str, float]]
    ) -> tuple[Cause, list[Group]]:
        """A cause with variants of a group with some shapes, and these.

        Existing variants are reused. In the rows of turns, new ones have the columns of
        the group.
        """
        alike = group.with_same_parameters(cause.variants)
        known = {frozenset(g.shape.items()): g for g in alike}
        keys = [frozenset(shape.items()) for shape in shapes]
        wanted = dict(zip(keys, shapes, strict=True))
        missing = [key for key in wanted if key not in known]
        new = [wanted[key] for key in missing]
        cause, added = self.dictionary.add_shapes(cause, group, new)
        for variant in added:
            self.copy_turn_columns(group, variant)
        known |= dict(zip(missing, added, strict=True))
        return cause, [known[key] for key in keys]

    def copy_turn_columns(self, group: Group, variant: Group) -> None:
        """Give a new variant the columns of a group in the rows of turns."""
        self.turn_rows = [
            rows.with_copied_columns(group.columns, variant.columns)
            for rows in self.turn_rows
        ]

    def follow_turns(self, state: State, values: Array) -> None:
        """Update the rows of turns about a state, without the accelerometers' rows."""
        if self.turns is None:
            return
        free = self.dictionary.unoriented.any()  # else turns end at known attitudes
        linear = self.system.linearised(state) if free else []
        self.turn_rows = self.turns.linearised(state, self.pad(values), linear, None)

    @property
    def contradicted_turns(self) -> tuple[tuple[int, int], ...]:
        """Pairs of windows whose attitudes contradict the gyroscopes."""
        return tuple(self.turns.tracker.contradicted_turns) if self.turns else ()

    def turns_at(self, state: State) -> list[Turn]:
        """The turns integrated with a state."""
        return [] if self.turns is None else list(self.turns.tracker.turns(state))

    def outputs_in_turns(
        self, turns: Sequence[Turn], state: State, members: Sequence[Member]
    ) -> Iterator[Array]:
        """Contribution of some causes to the outputs in turns, (m + 1, 6) each."""
        effects = [g.effect for _, g in members]
        terms = [t for t in state.terms if t.effect in effects]
        if self.turns is not None:
            yield from self.turns.outputs_of_terms(turns, state, terms)
