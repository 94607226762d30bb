"""The state at the estimate of a set: what is not linear is linear about it.

Source: Gauss and Newton.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State, Term
from fieldcal.model.system.fitted import whole
from fieldcal.model.system.linear_rows import Linear
from fieldcal.model.system.linear_system import System, gram
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.turns.turn import Turn
from fieldcal.physics.effect import Motion, Sensor

NEWTON = 6
"""Steps of Gauss and Newton for one set."""

CONVERGED = 0.03
"""Largest step of a column, in standard deviations, that counts as none."""


class GaussNewton:
    """States of one session, and what its rows say about them.

    Parameters
    ----------
    system : rows and their dictionary
    nominal : the state that a simulation starts from
    turns : what makes rows of turns, if there are any

    """

    def __init__(
        self, system: System, nominal: State, turns: Turns | None = None
    ) -> None:
        self.system, self.nominal, self.turns = system, nominal, turns
        self.dictionary: Dictionary = system.dictionary
        self.turned: list[TurnRows] = []

    def padded(self, values: Array) -> Array:
        """Values with those of columns that were added since: zero."""
        return np.pad(values, (0, self.dictionary.width - len(values)))

    def wanted(self, members: Sequence[Member]) -> NDArray[np.bool_]:
        """Columns of a set, and the turns of unknown orientations."""
        d = self.dictionary
        wanted = np.zeros(d.width, dtype=bool)
        for group in [*d.always, *d.unfitted, *(g for _, g in members)]:
            wanted[group.columns] = True
        if d.free.any():
            wanted[d.rotations] = True
        return wanted

    def gram(self, state: State, values: Array, known: Set | None) -> Gram:
        """What all rows say of all columns about a state."""
        values = self.padded(values)
        linear = self.system.linearised(state)
        if self.turns is not None:
            self.turned = self.turns.linearised(state, values, linear, known)
        return gram(linear, self.dictionary, values, self.turned)

    def followed(self, state: State, values: Array) -> None:
        """Follow the turns about a state; the accelerometers on the way are left."""
        if self.turns is None:
            return
        free = self.dictionary.free.any()  # only there windows say where turns end
        linear = self.system.linearised(state) if free else []
        self.turned = self.turns.linearised(state, self.padded(values), linear, None)

    def gram_of(
        self, linear: Sequence[Linear], values: Array, wanted: NDArray[np.bool_]
    ) -> Gram:
        """What rows say of some columns, linearised already; turns as they were."""
        d, some = self.dictionary, np.flatnonzero(wanted)
        return gram(linear, d, self.padded(values), self.turned, some)

    def settled(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        sizes: Sizes | None = None,
    ) -> tuple[State, Array, Set]:
        """The state at the estimate of a set, by Gauss and Newton, and that set."""
        values = self.padded(values)
        for _ in range(NEWTON):
            wanted = self.wanted(members) | (values != 0)
            linear = self.system.linearised(state, wanted)
            rows = self.gram_of(linear, values, wanted)
            search = Search(self.dictionary, rows)
            found = search.evaluated(members, sizes)
            sizes = found.sizes
            before = values
            state, values = self.moved(found)
            if self.step(found, before, values) < CONVERGED:
                break
        return state, values, found

    def step(self, found: Set, before: Array, values: Array) -> float:
        """The largest step of what is in the state, in standard deviations of a set."""
        error = np.sqrt(np.maximum(np.diag(found.state.inverse), 1e-300))
        step = np.abs(values - self.padded(before))[found.state.columns] / error
        counted = np.isin(found.state.columns, self._nonlinear(found.members))
        return float(step[counted].max(initial=0.0))

    def _nonlinear(self, members: tuple[Member, ...]) -> Array:
        """Columns whose values are in the state: all that are no course in time."""
        groups = [*self.dictionary.always, *(g for _, g in members)]
        return np.concatenate([g.columns for g in groups if g.in_state])

    def turns_by(self, state: State) -> list[Turn]:
        """The turns as a state follows them."""
        return [] if self.turns is None else list(self.turns.turning.turns(state))

    def on_turns(
        self, turns: Sequence[Turn], state: State, members: Sequence[Member]
    ) -> Iterator[Array]:
        """What some causes of a state make of the outputs in turns, (m + 1, 6) each."""
        if self.turns is None:
            return
        terms = tuple(
            t for t in state.terms
            if any(t.effect is g.effect for _, g in members)
        )  # fmt: skip
        yield from self.turns.courses(turns, state, terms)

    def moved(self, found: Set) -> tuple[State, Array]:
        """The state at a set's estimate, and its columns' values."""
        d = self.dictionary
        kept = np.zeros(d.width, dtype=bool)
        kept[self._nonlinear(found.members)] = True
        if d.free.any():
            kept[d.rotations] = True
        values = np.where(kept, whole(found.state, d), 0.0)
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
        """What measured attitudes are off by, (p, 3), where there are any."""
        d = self.dictionary
        if d.attitude >= 0:
            yield values[d.attitude : d.attitude + 3 * d.places].reshape(-1, 3)
