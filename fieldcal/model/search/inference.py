"""From rows to an explanation: linearise, search, move the state, until both stay.

The search is exact in what is linear. A set that was found moves the state to its
estimate, where everything is linearised and searched again, beginning with that set.
What a part of the same recording was explained by may be begun with as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.proportion import in_proportion
from fieldcal.model.search.selection import SETTLED, Search
from fieldcal.model.state import State, Term
from fieldcal.model.system.fitted import whole
from fieldcal.model.system.linear_system import System, gram
from fieldcal.model.system.turn_rows import TurnRows, Turns
from fieldcal.model.system.window_rows import Linear
from fieldcal.physics.effect import Motion, Sensor
from fieldcal.physics.shape import FINEST

PASSES = 8
"""Linearisations at most; a set that comes and goes is settled by weight."""

NEWTON = 6
"""Steps of Gauss and Newton for one set."""

AFAR = 0.05
"""An angle whose square shows, rad: half of it is 0.01 m/s^2 of gravity."""

CONVERGED = 0.03
"""Largest step of a column, in standard deviations, that counts as none."""


@dataclass(frozen=True, slots=True)
class Inferred:
    """What was found.

    Attributes
    ----------
    inference : it was found by
    search : about the last state
    best : the set of the highest weight
    state : its estimate
    values : (k,) of the dictionary's columns in that state
    turned : rows of the turns about it

    """

    inference: Inference
    search: Search
    best: Set
    state: State
    values: Array
    turned: Sequence[TurnRows]


class Inference:
    """The inference of one session.

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

    def run(self, begin: Sequence[Member] | None = None) -> Inferred:
        """Search until set and state stay.

        Parameters
        ----------
        begin : of any dictionary, what it is to begin with instead of with nothing;
            a position far from where it is said to be is then not looked for

        """
        members: tuple[Member, ...] = ()
        start: Array = np.zeros(self.dictionary.width)
        state, values, _ = self.settled(self.nominal, start, ())
        seen: set[tuple[tuple[str, int], ...]] = set()
        search = Search(self.dictionary, self.gram(state, values, None))
        if begin is not None:
            found = search.upheld(self.dictionary.like(begin))
        if begin is None or (begin and not found.members):
            state, values, found = self._from_nothing(state, values, search)
        about = dict.fromkeys([found, search.evaluated(())])
        self.dictionary.joined(in_proportion(self.dictionary, list(about)))
        for _ in range(PASSES):
            seen.add(search.key(found.members))
            if found.members != members:
                state, values, _ = self.settled(
                    state, values, found.members, found.sizes
                )
                members = self.shaped(state, values, found.members, found.sizes)
                # with the columns that are in the state now: those of the grid's
                # points, estimated beside, would be taken off the way a second time
                state, values, found = self.settled(state, values, members, found.sizes)
            search = Search(self.dictionary, self.gram(state, values, found))
            found = search.run(members)
            if found.keys == frozenset(c.key for c, _ in members):
                own = search.evaluated(members, found.sizes)  # with its own shapes
                if found.score <= own.score + SETTLED:
                    found = own
                    break
            if search.key(found.members) in seen:
                break
        return Inferred(self, search, found, state, self._padded(values), self.turned)

    def _from_nothing(
        self, state: State, values: Array, search: Search
    ) -> tuple[State, Array, Set]:
        """The best set about a state of nothing, and where it is about another one."""
        found, turned = search.run(), self.turned
        far = self._afar(state, values, search)
        if far is not None and far[2].score > found.score:
            return far
        self.turned = turned
        return state, values, found

    def _afar(
        self, state: State, values: Array, search: Search
    ) -> tuple[State, Array, Set] | None:
        """The best set about a position set far from where it is said to be.

        No columns about the one place show the other: what is linear in the angle
        leaves so much that it loses against whatever has more columns.
        """
        nothing = search.evaluated(())
        for offer in search.offers(nothing):
            cause, group = offer.member
            if cause.kind != "position":
                continue
            one = search.taken(nothing, offer)
            there = whole(one.state, self.dictionary)[group.columns]
            if np.abs(there).max() < AFAR:
                return None
            members = one.members
            state, values, _ = self.settled(state, values, members, one.sizes)
            about = Search(self.dictionary, self.gram(state, values, None))
            return state, values, about.run(members)
        return None

    def shaped(
        self, state: State, values: Array, members: tuple[Member, ...], sizes: Sizes
    ) -> tuple[Member, ...]:
        """The members with their shapes refined between the points of the grid."""
        for i, (_, group) in enumerate(members):
            if len(group.shape) == 1 and group.effect is not None:
                members = self._refined(state, values, members, i, sizes)
        return members

    def beside(self, found: Inferred, there: Set) -> Set:
        """A set with its shapes refined, but for those that what was found has.

        What that takes of columns is not in the dictionary afterwards.
        """
        own = Inference(self.system.apart(), self.nominal)
        own.turned = list(found.turned)
        members, known = there.members, [g for _, g in found.best.members]
        for i, (_, group) in enumerate(members):
            if group.shape and group.effect is not None and group not in known:
                members = own._refined(
                    found.state, found.values, members, i, there.sizes
                )
        values = own._padded(found.values)
        wanted = own.wanted(members) | (values != 0)
        linear = own.system.linearised(found.state, wanted)
        search = Search(own.dictionary, own.gram_of(linear, values, wanted))
        return search.evaluated(members, there.sizes)

    def _refined(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        i: int,
        sizes: Sizes,
    ) -> tuple[Member, ...]:
        """The members with one shape where the evidence is highest.

        By steps closer and closer; last by the parabola through three points of a time
        constant's logarithm, which gives its uncertainty as well.
        """
        cause, group = members[i]
        (shape,) = group.effect.shapes  # type: ignore[union-attr]
        scores: list[float] = []
        for ratio in shape.finer:
            here = group
            near = shape.near(self.dictionary.x, group.shape[shape.name], ratio)
            cause, tried = self._near(cause, group, near)
            every = [group, *tried]
            scores = self._scores(state, values, members, i, cause, every, sizes)
            group = every[int(np.argmax(scores))]
        if shape.kind != "instant" and len(scores) == 3:
            cause, group = self._at_top(cause, here, group, scores, shape.name)
        return (*members[:i], (cause, group), *members[i + 1 :])

    def _scores(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        i: int,
        cause: Cause,
        every: Sequence[Group],
        sizes: Sizes,
    ) -> list[float]:
        """Weights of a set with each of some groups in the place of one member."""
        values = self._padded(values)
        wanted = self.wanted([*members[:i], *members[i + 1 :]]) | (values != 0)
        for one in every:
            wanted[one.columns] = True
        linear = self.system.linearised(state, wanted)
        search = Search(self.dictionary, self.gram_of(linear, values, wanted))
        return [
            search.evaluated(
                (*members[:i], (cause, one), *members[i + 1 :]), sizes
            ).score
            for one in every
        ]

    def _at_top(
        self, cause: Cause, here: Group, best: Group, scores: list[float], name: str
    ) -> tuple[Cause, Group]:
        """The group at the top of the parabola through its last three points."""
        middle, down, up = scores
        step = float(np.log(FINEST))
        bend = max(2 * middle - down - up, 1e-6) / step**2
        moved = float(np.clip((up - down) / (2 * step * bend), -step, step))
        at = here.shape[name] * float(np.exp(moved))
        cause, (group,) = self._near(cause, best, [at])
        known = replace(group, unsure=at / float(np.sqrt(bend)))
        variants = tuple(known if g is group else g for g in cause.variants)
        return self.dictionary.exchanged(cause, variants), known

    def _near(
        self, cause: Cause, group: Group, values: Sequence[float]
    ) -> tuple[Cause, list[Group]]:
        """A cause with more variants; on turns they are as the one they are near."""
        cause, new = self.dictionary.refined(cause, group, values)
        for one in new:
            self.turned = [t.copied(group.columns, one.columns) for t in self.turned]
        return cause, new

    def _padded(self, values: Array) -> Array:
        """Values with those of columns that were added since: zero."""
        return np.pad(values, (0, self.dictionary.width - len(values)))

    def wanted(self, members: Sequence[Member]) -> NDArray[np.bool_]:
        """Columns of a set, and the turns of unknown orientations."""
        d = self.dictionary
        wanted = np.zeros(d.width, dtype=bool)
        for group in [*d.always, *(g for _, g in members)]:
            wanted[group.columns] = True
        if d.free.any():
            wanted[d.small_rotation : d.small_rotation + 2 * d.places] = True
        return wanted

    def gram(self, state: State, values: Array, known: Set | None) -> Gram:
        """What all rows say of all columns about a state."""
        values = self._padded(values)
        linear = self.system.linearised(state)
        if self.turns is not None:
            self.turned = self.turns.linearised(state, values, linear, known)
        return gram(linear, self.dictionary, values, self.turned)

    def gram_of(
        self, linear: Sequence[Linear], values: Array, wanted: NDArray[np.bool_]
    ) -> Gram:
        """What rows say of some columns, linearised already; turns as they were."""
        d, some = self.dictionary, np.flatnonzero(wanted)
        return gram(linear, d, self._padded(values), self.turned, some)

    def settled(
        self,
        state: State,
        values: Array,
        members: tuple[Member, ...],
        sizes: Sizes | None = None,
    ) -> tuple[State, Array, Set]:
        """The state at the estimate of a set, by Gauss and Newton, and that set."""
        values = self._padded(values)
        for _ in range(NEWTON):
            wanted = self.wanted(members) | (values != 0)
            linear = self.system.linearised(state, wanted)
            rows = self.gram_of(linear, values, wanted)
            search = Search(self.dictionary, rows)
            found = search.evaluated(members, sizes)
            sizes = found.sizes
            before = values
            state, values = self.moved(found)
            error = np.sqrt(np.maximum(np.diag(found.state.inverse), 1e-300))
            step = np.abs(values - before)[found.state.columns] / error
            counted = np.isin(found.state.columns, self._nonlinear(members))
            if step[counted].max(initial=0.0) < CONVERGED:
                break
        return state, values, found

    def _nonlinear(self, members: tuple[Member, ...]) -> Array:
        """Columns whose values are in the state: all that are no course in time."""
        groups = [*self.dictionary.always, *(g for _, g in members)]
        return np.concatenate([g.columns for g in groups if g.in_state])

    def on_turns(self, state: State, members: Sequence[Member]) -> Iterator[Array]:
        """What some causes make of the outputs in each turn, (m + 1, 6)."""
        if self.turns is None:
            return
        terms = tuple(
            t for t in state.terms
            if any(t.effect is g.effect for _, g in members)
        )  # fmt: skip
        yield from self.turns.courses(state, terms)

    def moved(self, found: Set) -> tuple[State, Array]:
        """The state at a set's estimate, and its columns' values."""
        d = self.dictionary
        kept = np.zeros(d.width, dtype=bool)
        kept[self._nonlinear(found.members)] = True
        if d.free.any():
            kept[d.small_rotation : d.small_rotation + 2 * d.places] = True
        values = np.where(kept, whole(found.state, d), 0.0)
        nominal = self.nominal
        small_rotation = values[
            d.small_rotation : d.small_rotation + 2 * d.places
        ].reshape(-1, 2)
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
            small_rotation,
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
