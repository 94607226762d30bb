"""From rows to an explanation: linearise, search, move the state, until both stay.

The search is exact in what is linear. A set that was found moves the state to its
estimate, where everything is linearised and searched again, beginning with that set.
What a part of the same recording was explained by may be begun with as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.proportion import in_proportion
from fieldcal.model.search.refinement import Refinement
from fieldcal.model.search.selection import SETTLED, Search
from fieldcal.model.state import State
from fieldcal.model.system.fitted import whole
from fieldcal.model.system.turn_rows import TurnRows

PASSES = 8
"""Linearisations at most; a set that comes and goes is settled by weight."""

OWN_SIGMA = 0.5
"""Fall of ln Z where a time constant is off by its own uncertainty."""

STAYED = 1.0
"""Largest step of a column, in standard deviations, after which rows of turns need not
be linearised again."""

SCATTERED = 4.0
"""Instability, in that of a typical device, behind which causes may be that nothing but
each other shows."""

Key = tuple[tuple[str, int], ...]
"""Of a set: the keys of its causes with their variants."""

AFAR = 0.05
"""An angle whose square shows, rad: half of it is 0.01 m/s^2 of gravity."""


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
    contradicted : windows between which the gyroscopes lead elsewhere about it
    been : sets that a state of their own was found for, by their keys

    """

    inference: Inference
    search: Search
    best: Set
    state: State
    values: Array
    turned: Sequence[TurnRows]
    contradicted: tuple[tuple[int, int], ...]
    been: frozenset[Key]


class Inference(Refinement):
    """The inference of one session."""

    def run(self, begin: Sequence[Member] | None = None) -> Inferred:
        """Search until set and state stay.

        Parameters
        ----------
        begin : of any dictionary, what it is to begin with instead of with nothing;
            other states to begin from are then not looked for, nor pairs of causes of
            which neither is worth anything by itself

        """
        start: Array = np.zeros(self.dictionary.width)
        state, values, _ = self.settled(self.nominal, start, ())
        search = Search(self.dictionary, self.gram(state, values, None))
        if begin is not None:
            found = search.upheld(self.dictionary.like(begin))
        if begin is None or (begin and not found.members):
            state, values, found = self._from_nothing(state, values, search)
        about = dict.fromkeys([found, search.evaluated(())])
        self.dictionary.joined(in_proportion(self.dictionary, list(about)))
        return self._until_it_stays(state, values, found, thorough=begin is None)

    def resumed(self, better: Set, before: Inferred) -> Inferred:
        """Go on with a set that is better than what was found before.

        What leads back to a set that was gone through before would lead to all that
        followed it: of several that are about as likely, each leads to the next one.
        """
        start: Array = np.zeros(self.dictionary.width)
        state, values, _ = self.settled(self.nominal, start, ())
        return self._until_it_stays(state, values, better, False, before.been)

    def _until_it_stays(
        self,
        state: State,
        values: Array,
        found: Set,
        thorough: bool,
        been: frozenset[Key] = frozenset(),
    ) -> Inferred:
        """Settle and search in turn, from a set, about a state that has no members.

        What costs much is tried if it is to be `thorough`, where the rest stays. A set
        that has `been` gone through ends it.
        """
        members: tuple[Member, ...] = ()
        seen = set(been)
        passed: dict[tuple[Member, ...], None] = {}
        for _ in range(PASSES):
            seen.add(Search.key(found.members))
            if found.members != members:
                state, values, _ = self.settled(
                    state, values, found.members, found.sizes
                )
                members = self.shaped(state, values, found.members, found.sizes)
                # with the columns that are in the state now: those of the grid's
                # points, estimated beside, would be taken off the way a second time
                state, values, found = self.settled(state, values, members, found.sizes)
            search = Search(self.dictionary, self.gram(state, values, found))
            for before in passed:
                search.evaluated(before)  # it may be as likely as what replaced it
            passed[found.members] = None
            found = search.run(members, thorough=False)
            same = frozenset(c.key for c, _ in members)
            if thorough and found.keys == same:
                found = search.run(members)
            if found.keys == same:
                own = search.evaluated(members, found.sizes)  # with its own shapes
                # a point of the grid next to where a time constant was refined
                back = Search.key(found.members) in seen
                if found.score <= own.score + (OWN_SIGMA if back else SETTLED):
                    found = own
                    there, moved, _ = self.settled(state, values, members, found.sizes)
                    if self.step(found, values, moved) < STAYED:
                        break
                    state, values = there, moved
                    continue
            if Search.key(found.members) in seen:
                break
        astray = self.turns.turning.contradicted if self.turns is not None else ()
        return Inferred(
            self, search, found, state, self.padded(values), self.turned, tuple(astray),
            frozenset(seen),
        )  # fmt: skip

    def _from_nothing(
        self, state: State, values: Array, search: Search
    ) -> tuple[State, Array, Set]:
        """The best set about a state of nothing, or about another beginning."""
        best, turned = (state, values, search.run(thorough=False)), self.turned
        for begin in self._beginnings(search, best[2]):
            there, moved, _ = self.settled(state, values, begin.members, begin.sizes)
            about = Search(self.dictionary, self.gram(there, moved, None))
            found = about.run(begin.members, thorough=False)
            if found.score > best[2].score:
                best, turned = (there, moved, found), self.turned
        self.turned = turned
        return best

    def _beginnings(self, search: Search, found: Set) -> Iterator[Set]:
        """Sets whose states may be far from that of nothing, and explain more."""
        if (far := self._afar(search)) is not None:
            yield far
        usual = tuple((c, c.variants[0]) for c in self.dictionary.causes if c.usual)
        keys = {c.key for c, _ in usual}
        scatter = priors.SIZES[list(found.sizes.instability)]
        if (scatter.max() > SCATTERED and not keys <= found.keys) or (
            self._turned_otherwise(found, keys)
        ):
            yield search.evaluated(usual)

    def _turned_otherwise(self, found: Set, usual: set[str]) -> bool:
        """Whether turns are explained by what not every triad has, and not by that.

        It bends the state, about which what every triad has looks worse than it is.
        """
        if usual <= found.keys:
            return False
        others = [group.columns for cause, group in found.members if not cause.usual]
        at = np.concatenate([np.empty(0, int), *others])
        return any(np.isin(t.columns[t.design.any(axis=0)], at).any()
                   for t in self.turned)  # fmt: skip

    def _afar(self, search: Search) -> Set | None:
        """A position set far from where it is said to be, if one seems to be.

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
            return one if np.abs(there).max() >= AFAR else None
        return None

    def beside(self, found: Inferred, there: Set) -> Set:
        """A set with its shapes refined, but for those that what was found has.

        What that takes of columns is not in the dictionary afterwards.
        """
        own = self.copied(found)
        members, known = there.members, [g for _, g in found.best.members]
        for i, (_, group) in enumerate(members):
            if group.shape and group.effect is not None and group not in known:
                members = own.refined(
                    found.state, found.values, members, [i], there.sizes
                )
        search = own.search_among(found.state, found.values, [members])
        return search.evaluated(members, there.sizes)

    def copied(self, found: Inferred) -> Inference:
        """The same about what was found, of which columns that are added are its own.

        Turns are as they are about that.
        """
        own = Inference(self.system.apart(), self.nominal)
        own.turned = list(found.turned)
        return own
