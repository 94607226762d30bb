"""The base state at the estimate of a set, by iterated linearisation.

Source: Gauss and Newton.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State, Term
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.model.system.linear_rows import LinearRows
from fieldcal.model.system.linear_system import System, gram
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.effect import Motion, Sensor

MAX_NEWTON_STEPS = 6
"""Steps of Gauss and Newton for one set."""

CONVERGED = 0.03
"""Largest step of a column, in standard deviations, that counts as none."""


class GaussNewton:
    """Linearises the rows of a session about states, and fits sets.

    Parameters
    ----------
    system : rows and their dictionary
    nominal : nominal state
    turns : makes the rows of turns; None if there are no turns

    """

    def __init__(
        self, system: System, nominal: State, turns: Turns | None = None
    ) -> None:
        self.system, self.nominal, self.turns = system, nominal, turns
        self.dictionary: Dictionary = system.dictionary
        self.turn_rows: list[TurnRows] = []

    def pad(self, values: Array) -> Array:
        """Values of columns, padded with zeros for columns that were added since."""
        return np.pad(values, (0, self.dictionary.width - len(values)))

    def wanted_columns(self, members: Sequence[Member]) -> NDArray[np.bool_]:
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

    def follow_turns(self, state: State, values: Array) -> None:
        """Update the rows of turns about a state, without the accelerometers' rows."""
        if self.turns is None:
            return
        free = self.dictionary.unoriented.any()  # else turns end at known attitudes
        linear = self.system.linearised(state) if free else []
        self.turn_rows = self.turns.linearised(state, self.pad(values), linear, None)

    def gram_of(
        self, linear: Sequence[LinearRows], values: Array, wanted: NDArray[np.bool_]
    ) -> Gram:
        """Gram matrix of some columns from linearised rows, with the current turns."""
        d, some = self.dictionary, np.flatnonzero(wanted)
        return gram(linear, d, self.pad(values), self.turn_rows, some)

    def settle(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        sizes: Sizes | None = None,
    ) -> tuple[State, Array, Set]:
        """The state at the estimate of a set, by Gauss and Newton, and that set."""
        state, values = self._near_set_angles(state, self.pad(values), members)
        for _ in range(MAX_NEWTON_STEPS):
            wanted = self.wanted_columns(members) | (values != 0)
            linear = self.system.linearised(state, wanted)
            rows = self.gram_of(linear, values, wanted)
            search = Search(self.dictionary, rows)
            found = search.evaluate(members, sizes)
            sizes = found.sizes
            before = values
            state, values = self.state_at_estimate(found)
            if self.largest_step(found, before, values) < CONVERGED:
                break
        return state, values, found

    def _near_set_angles(
        self, state: State, values: Array, members: Sequence[Member]
    ) -> tuple[State, Array]:
        """The state with new members that are angles begun near where they are."""
        new = [g for c, g in members if c.position >= 0 and not values[g.columns].any()]
        turns = [self.system.starting_angles(self.nominal, g.position) for g in new]
        if not any(turn.any() for turn in turns):
            return state, values
        values, small = values.copy(), state.small_rotation.copy()
        for group, turn in zip(new, turns, strict=True):
            values[group.columns] = small[group.position] = turn
        return replace(state, small_rotation=small), values

    def largest_step(self, found: Set, before: Array, values: Array) -> float:
        """Largest change of the state's parameters, in their standard deviations."""
        error = np.sqrt(np.maximum(np.diag(found.state.inverse), 1e-300))
        step = np.abs(values - self.pad(before))[found.state.columns] / error
        counted = np.isin(found.state.columns, self._nonlinear(found.members))
        return float(step[counted].max(initial=0.0))

    def _nonlinear(self, members: tuple[Member, ...]) -> Array:
        """Columns whose estimates the state contains."""
        groups = [*self.dictionary.always, *(g for _, g in members)]
        return np.concatenate([g.columns for g in groups if g.in_state])

    def turns_at(self, state: State) -> list[Turn]:
        """The turns integrated with a state."""
        return [] if self.turns is None else list(self.turns.tracker.turns(state))

    def outputs_in_turns(
        self, turns: Sequence[Turn], state: State, members: Sequence[Member]
    ) -> Iterator[Array]:
        """Contribution of some causes to the outputs in turns, (m + 1, 6) each."""
        if self.turns is None:
            return
        terms = tuple(
            t for t in state.terms
            if any(t.effect is g.effect for _, g in members)
        )  # fmt: skip
        yield from self.turns.outputs_of_terms(turns, state, terms)

    def state_at_estimate(self, found: Set) -> tuple[State, Array]:
        """The state at a set's estimate, and its columns' values."""
        d = self.dictionary
        kept = np.zeros(d.width, dtype=bool)
        kept[self._nonlinear(found.members)] = True
        if d.unoriented.any():
            kept[d.rotations] = True
        values = np.where(kept, estimates_by_column(found.state, d), 0.0)
        nominal = self.nominal
        terms = [Term(t.effect, t.values, t.shape, t.origin) for t in nominal.terms]
        for _, group in found.members:
            if group.effect is None or not isinstance(group.effect, Motion | Sensor):
                continue
            full = np.zeros(len(group.effect.params))
            full[list(group.params)] = values[group.columns]
            terms.append(Term(group.effect, full, group.shape, group.origin))
        state = State(
            nominal.bias + values[d.bias : d.bias + 6],
            nominal.scale + values[d.scale : d.scale + 6],
            values[d.rotations].reshape(-1, 2),
            values[d.earth : d.earth + 3] if d.earth >= 0 else np.zeros(3),
            tuple(terms),
            *self._attitude(values),
        )
        return state, values

    def _attitude(self, values: Array) -> Iterator[Array]:
        """Errors of measured attitudes, (p, 3), if there are any."""
        d = self.dictionary
        if d.attitude >= 0:
            yield values[d.attitude : d.attitude + 3 * d.position_count].reshape(-1, 3)
