"""From rows to an explanation: linearise, search, update the state, until it converges.

The search is exact for the linearised rows. The state is then updated to the estimate
of the set that was found, the rows are linearised there, and the search begins again
with that set. It may also begin with an explanation of a part of the recording.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import GYR, Array
from fieldcal.model import priors
from fieldcal.model.evidence.gram import Gram
from fieldcal.model.evidence.sets import Set, SetKey
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.proportional_offsets import proportional_causes
from fieldcal.model.search.refinement import Refinement
from fieldcal.model.search.selection import MIN_LOG_RISE, Search
from fieldcal.model.state import State
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.model.system.turn_rows import TurnRows

MAX_LINEARISATIONS = 8
"""Largest number of linearisations; of sets that alternate, the likelier is kept."""

TIME_CONSTANT_LOG_LOSS = 0.5
"""Decrease of ln Z if a time constant is off by its own uncertainty."""

MAX_KEPT_STEP = 1.0
"""Largest step of a column, in standard deviations, after which rows of turns need not
be linearised again."""

LARGE_INSTABILITY = 4.0
"""Instability, in typical ones, above which causes may hide that show only together."""


@dataclass(frozen=True, slots=True)
class InferenceResult:
    """Result of an inference.

    Attributes
    ----------
    inference : that found it
    search : about the last state
    best : the set of the highest weight
    state : its estimate
    values : (k,) of the dictionary's columns in that state
    turn_rows : rows of the turns about it
    contradicted_turns : pairs of windows whose attitudes contradict the gyroscopes
    visited_keys : keys of the sets for which a state was calculated

    """

    inference: Inference
    search: Search
    best: Set
    state: State
    values: Array
    turn_rows: Sequence[TurnRows]
    contradicted_turns: tuple[tuple[int, int], ...]
    visited_keys: frozenset[SetKey]


def visible_angle(gram: Gram) -> float:
    """Smallest angle whose square the accelerometers show, rad.

    Half of it, times gravity, is as large as the noise of a window's mean.
    """
    info = gram.info[gram.kind < GYR.start]
    sigma = 1 / np.sqrt(np.median(info[info > 0])) if info.any() else np.inf
    return float(np.sqrt(2 * sigma / G0))


class Inference(Refinement):
    """The inference of one session."""

    def run(self, begin: Sequence[Member] | None = None) -> InferenceResult:
        """Search until set and state no longer change.

        Parameters
        ----------
        begin : members of any dictionary to start from, instead of the empty set; other
            starting states and the costly changes of sets are then not tried

        """
        start: Array = np.zeros(self.dictionary.width)
        state, values, _ = self.settle(self.nominal, start, ())
        search = Search(self.dictionary, self.gram(state, values, None))
        if begin is not None:
            found = search.drop_superfluous(self.dictionary.match_members(begin))
        if begin is None or (begin and not found.members):
            state, values, found = self._search_from_nominal(state, values, search)
        about = dict.fromkeys([found, search.evaluate(())])
        self.dictionary.add_causes(proportional_causes(self.dictionary, list(about)))
        return self._iterate(state, values, found, thorough=begin is None)

    def resume(self, better: Set, before: InferenceResult) -> InferenceResult:
        """Continue from a better set than that of an earlier result.

        It ends at a set that was visited before: sets of about equal weight would
        otherwise lead to each other in a cycle.
        """
        start: Array = np.zeros(self.dictionary.width)
        state, values, _ = self.settle(self.nominal, start, ())
        return self._iterate(state, values, better, False, before.visited_keys)

    def _iterate(
        self,
        state: State,
        values: Array,
        found: Set,
        thorough: bool,
        been: frozenset[SetKey] = frozenset(),
    ) -> InferenceResult:
        """Update the state and search in turn, starting from set `found`.

        If `thorough`, costly changes are tried once cheap ones find nothing. A set in
        `been` ends it.
        """
        members: tuple[Member, ...] = ()
        seen = set(been)
        passed: dict[tuple[Member, ...], None] = {}
        for _ in range(MAX_LINEARISATIONS):
            seen.add(Search.key(found.members))
            if found.members != members:
                state, values, _ = self.settle(
                    state, values, found.members, found.sizes
                )
                members = self.refine_shapes(state, values, found.members, found.sizes)
                # with the columns that are in the state now: those of the grid's
                # points, estimated beside, would be taken off the way a second time
                state, values, found = self.settle(state, values, members, found.sizes)
            search = Search(self.dictionary, self.gram(state, values, found))
            for before in passed:
                search.evaluate(before)  # it may be as likely as what replaced it
            passed[found.members] = None
            found = search.run(members, thorough=False)
            same = frozenset(c.key for c, _ in members)
            if thorough and found.keys == same:
                found = search.run(members)
            if found.keys == same:
                own = search.evaluate(members, found.sizes)  # with its own shapes
                # a point of the grid next to where a time constant was refined
                back = Search.key(found.members) in seen
                if found.score <= own.score + (
                    TIME_CONSTANT_LOG_LOSS if back else MIN_LOG_RISE
                ):
                    found = own
                    there, moved, _ = self.settle(state, values, members, found.sizes)
                    if self.largest_step(found, values, moved) < MAX_KEPT_STEP:
                        break
                    state, values = there, moved
                    continue
            if Search.key(found.members) in seen:
                break
        astray = self.turns.tracker.contradicted_turns if self.turns is not None else ()
        return InferenceResult(
            self, search, found, state, self.pad(values), self.turn_rows, tuple(astray),
            frozenset(seen),
        )  # fmt: skip

    def _search_from_nominal(
        self, state: State, values: Array, search: Search
    ) -> tuple[State, Array, Set]:
        """The best set about the nominal state, or about another starting set."""
        best, turned = (state, values, search.run(thorough=False)), self.turn_rows
        for begin in self._starting_sets(search, best[2]):
            there, moved, _ = self.settle(state, values, begin.members, begin.sizes)
            about = Search(self.dictionary, self.gram(there, moved, None))
            found = about.run(begin.members, thorough=False)
            if found.score > best[2].score:
                best, turned = (there, moved, found), self.turn_rows
        self.turn_rows = turned
        return best

    def _starting_sets(self, search: Search, found: Set) -> Iterator[Set]:
        """Starting sets whose states may be far from the nominal one."""
        if (far := self._set_with_large_angle(search)) is not None:
            yield far
        if elsewhere := self._positions_elsewhere():
            yield search.evaluate(elsewhere)
        usual = tuple((c, c.variants[0]) for c in self.dictionary.causes if c.usual)
        keys = {c.key for c, _ in usual}
        scatter = priors.SIZES[list(found.sizes.instability)]
        if (scatter.max() > LARGE_INSTABILITY and not keys <= found.keys) or (
            self._turns_need_usual_causes(found, keys)
        ):
            yield search.evaluate(usual)

    def _turns_need_usual_causes(self, found: Set, usual: set[str]) -> bool:
        """Whether turns are explained by unusual causes, and not by all usual ones.

        Usual causes look less likely about a state that contains unusual ones.
        """
        if usual <= found.keys:
            return False
        others = [group.columns for cause, group in found.members if not cause.usual]
        at = np.concatenate([np.empty(0, int), *others])
        return any(np.isin(t.columns[t.design.any(axis=0)], at).any()
                   for t in self.turn_rows)  # fmt: skip

    def _set_with_large_angle(self, search: Search) -> Set | None:
        """Set of one position with a large angle error, if there seems to be one.

        A large angle is not linear: about the stated angle its residuals make it less
        likely than causes with more columns. It is large if its square shows.
        """
        nothing = search.evaluate(())
        for offer in search.offers(nothing):
            cause, group = offer.member
            if cause.kind != "position":
                continue
            one = search.accept(nothing, offer)
            there = estimates_by_column(one.state, self.dictionary)[group.columns]
            return one if np.abs(there).max() >= visible_angle(search.gram) else None
        return None

    def _positions_elsewhere(self) -> tuple[Member, ...]:
        """Positions whose force is far from the stated one, if they are the fewer.

        Two that were exchanged hide each other: about the stated angles, everything
        else seems likelier.
        """
        causes = [c for c in self.dictionary.causes if c.position >= 0]
        far = [
            c
            for c in causes
            if self.system.starting_angles(self.nominal, c.position).any()
        ]
        if 2 * len(far) >= len(causes):  # then the device is what is different
            return ()
        return tuple((c, c.variants[0]) for c in far)

    def refine_beside(self, found: InferenceResult, there: Set) -> Set:
        """A set with its shapes refined, except those that the result contains.

        The columns that this needs are added to a copy of the dictionary.
        """
        own = self.independent_copy(found)
        members, known = there.members, [g for _, g in found.best.members]
        for i, (_, group) in enumerate(members):
            if group.shape and group.effect is not None and group not in known:
                members = own.refine_shape(
                    found.state, found.values, members, [i], there.sizes
                )
        search = own.search_among(found.state, found.values, [members])
        return search.evaluate(members, there.sizes)

    def independent_copy(self, found: InferenceResult) -> Inference:
        """A copy for a result, with its turns, to which columns can be added."""
        own = Inference(self.system.independent_copy(), self.nominal)
        own.turn_rows = list(found.turn_rows)
        return own
