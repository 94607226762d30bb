"""From rows to an explanation: linearise, search, update the state, until it converges.

The search is exact for the linearised rows. The state is then updated to the estimate
of the set that was found, the rows are linearised there, and the search begins again
with that set. It may also begin with an explanation of a part of the recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import thresholds, tolerances
from fieldcal.model.evidence.sets import Set, SetKey, Sets
from fieldcal.model.evidence.sizing import Member, keys_of
from fieldcal.model.search.gauss_newton import GaussNewton
from fieldcal.model.search.proportional_offsets import proportional_causes
from fieldcal.model.search.refinement import Refinement
from fieldcal.model.search.selection import Search, is_exhausted
from fieldcal.model.search.starting_sets import starting_sets
from fieldcal.model.search.variations import drop_superfluous
from fieldcal.model.state import State
from fieldcal.model.system.turn_rows import TurnRows


@dataclass(frozen=True, slots=True)
class InferenceResult:
    """Result of an inference.

    Attributes
    ----------
    fit : linearises the rows of the session
    search : about the last state
    best : the set of the highest weight
    state : its estimate
    values : (k,) of the dictionary's columns in that state
    turn_rows : rows of the turns about it
    contradicted_turns : pairs of windows whose attitudes contradict the gyroscopes
    visited_keys : keys of the sets for which a state was calculated

    """

    fit: GaussNewton
    search: Search
    best: Set
    state: State
    values: Array
    turn_rows: Sequence[TurnRows]
    contradicted_turns: tuple[tuple[int, int], ...]
    visited_keys: frozenset[SetKey]

    @property
    def exhausted(self) -> bool:
        """Whether rows took so many causes that none of them counts."""
        return is_exhausted(self.best)

    def independent_fit(self) -> GaussNewton:
        """A copy of the fit about this result, to which columns can be added."""
        return self.fit.independent_copy(self.turn_rows)

    def with_refined_shapes(self, visited: Set) -> Set:
        """A visited set with its shapes refined, except those that `best` contains.

        The columns that this needs are added to a copy of the dictionary.
        """
        fit = self.independent_fit()
        refinement = Refinement(fit, self.state, self.values, visited.sizes)
        members, refined = visited.members, [g for _, g in self.best.members]
        for i, (_, group) in enumerate(members):
            if group.shape and group.effect is not None and group not in refined:
                members = refinement.refine_shape(members, [i])
        sets = fit.sets_with_columns_of(self.state, self.values, [members])
        return sets.evaluate(members, visited.sizes)


class Inference:
    """The inference of one session, whose rows `fit` linearises."""

    def __init__(self, fit: GaussNewton) -> None:
        self.fit = fit

    def run(self, begin: Sequence[Member] | None = None) -> InferenceResult:
        """Search until set and state no longer change.

        `begin` are members of any dictionary to start from, instead of the empty set;
        other starting states and the costly changes of sets are then not tried.
        """
        dictionary = self.fit.dictionary
        state, values = self._state_without_causes()
        search = self._search_about(state, values, None)
        known = () if begin is None else dictionary.match_members(begin)
        best = drop_superfluous(search.sets, known) if begin is not None else None
        rivals: tuple[Set, ...] = ()
        if best is None or (begin and not best.members):
            state, values, best, rivals = self._search_from_nominal(
                state, values, search
            )
        about = dict.fromkeys([best, search.sets.evaluate(())])
        dictionary.add_causes(proportional_causes(dictionary, list(about)))
        return self._iterate(state, values, best, begin is None, rivals=rivals)

    def run_from(self, better: Set, visited_keys: frozenset[SetKey]) -> InferenceResult:
        """Search from a set until set and state no longer change.

        It ends at a set that was visited before: sets of about equal weight would
        otherwise lead to each other in a cycle.
        """
        state, values = self._state_without_causes()
        return self._iterate(state, values, better, False, visited_keys)

    def hold(self, members: Sequence[Member]) -> InferenceResult:
        """The result with some members of any dictionary, without a search."""
        fit = self.fit
        known = fit.dictionary.match_members(members)
        state, values = self._state_without_causes()
        state, values, best = fit.settle(state, values, known)
        search = self._search_about(state, values, best)
        best = search.sets.evaluate(known, best.sizes)
        return InferenceResult(
            fit, search, best, state, fit.pad(values), fit.turn_rows,
            fit.contradicted_turns, frozenset(),
        )  # fmt: skip

    def _state_without_causes(self) -> tuple[State, Array]:
        """The state at the estimate of the empty set, and its columns' values."""
        zeros: Array = np.zeros(self.fit.dictionary.width)
        state, values, _ = self.fit.settle(self.fit.nominal, zeros, ())
        return state, values

    def _search_about(self, state: State, values: Array, known: Set | None) -> Search:
        """A search over all rows and columns, linearised about a state."""
        gram = self.fit.gram(state, values, known)
        return Search(Sets(self.fit.dictionary, gram))

    def _iterate(
        self,
        state: State,
        values: Array,
        best: Set,
        thorough: bool,
        visited_keys: frozenset[SetKey] = frozenset(),
        rivals: Sequence[Set] = (),
    ) -> InferenceResult:
        """Update the state and search in turn, starting from the set `best`.

        If `thorough`, costly changes are tried once cheap ones find nothing. A set
        whose key is in `visited_keys` ends it, and one of too many causes is kept as it
        is. The sets `rivals` are evaluated as well.
        """
        fit = self.fit
        members: tuple[Member, ...] = ()
        visited = set(visited_keys)
        earlier = dict.fromkeys(one.members for one in rivals)
        for _ in range(tolerances.MAX_LINEARISATIONS):
            if is_exhausted(best):
                return self.hold(best.members)
            visited.add(Sets.key(best.members))
            if best.members != members:
                members, state, values, best = self._settle_refined(state, values, best)
            search = self._search_about(state, values, best)
            for other in earlier:
                search.sets.evaluate(other)  # it may be as likely as what replaced it
            earlier[best.members] = None
            best = _search_from(search, members, thorough)
            returned = Sets.key(best.members) in visited
            own = _own_if_no_better(search, members, best, returned)
            if own is None and returned:
                break
            if own is None:
                continue
            best = own
            next_state, next_values, _ = fit.settle(state, values, members, best.sizes)
            if fit.largest_step(best, values, next_values) < thresholds.VISIBLE:
                break
            state, values = next_state, next_values
        return InferenceResult(
            fit, search, best, state, fit.pad(values), fit.turn_rows,
            fit.contradicted_turns, frozenset(visited),
        )  # fmt: skip

    def _settle_refined(
        self, state: State, values: Array, best: Set
    ) -> tuple[tuple[Member, ...], State, Array, Set]:
        """Refine the shapes of a set; its members, and the estimate with them.

        The estimate is the state, the values (k,) of the dictionary's columns in it,
        and the set about it.
        """
        state, values, _ = self.fit.settle(state, values, best.members, best.sizes)
        refinement = Refinement(self.fit, state, values, best.sizes)
        members = refinement.refine_shapes(best.members)
        # The columns of the shapes on the grid must leave the state. Otherwise
        # what they explain is subtracted from the rows of turns twice.
        return members, *self.fit.settle(state, values, members, best.sizes)

    def _search_from_nominal(
        self, state: State, values: Array, search: Search
    ) -> tuple[State, Array, Set, tuple[Set, ...]]:
        """The best set about the nominal state, or about another starting set.

        With the state, the columns' values in it, and what other starts led to.
        """
        best = (state, values, search.run(thorough=False))
        found = [best[2]]
        turn_rows = self.fit.turn_rows
        for start in starting_sets(self.fit, search, best[2]):
            state_there, values_there, _ = self.fit.settle(
                state, values, start.members, start.sizes
            )
            about = self._search_about(state_there, values_there, None)
            candidate = about.run(start.members, thorough=False)
            found.append(candidate)
            if candidate.score > best[2].score:
                best = (state_there, values_there, candidate)
                turn_rows = self.fit.turn_rows
        self.fit.turn_rows = turn_rows
        return *best, tuple(one for one in found if one is not best[2])


def resume(better: Set, before: InferenceResult) -> InferenceResult:
    """Continue from a better set than that of an earlier result.

    Columns are added to a copy of the fit: the earlier result stands if this one is no
    better, and its Gram matrix has only the columns that its dictionary had.
    """
    own = Inference(before.fit.continuing_copy())
    return own.run_from(better, before.visited_keys)


def _search_from(search: Search, members: tuple[Member, ...], thorough: bool) -> Set:
    """The best set, starting from a set with these members.

    If `thorough`, costly changes are tried once cheap ones find no other causes.
    """
    best = search.run(members, thorough=False)
    if thorough and best.keys == keys_of(members):
        return search.run(members)
    return best


def _own_if_no_better(
    search: Search, members: tuple[Member, ...], best: Set, returned: bool
) -> Set | None:
    """The set with these members, with its own shapes, if the best is no better.

    None if the best set has other causes, or shapes that are clearly likelier. If it
    has `returned` to a set visited before, it may be the point of the grid next to
    which a time constant was refined.
    """
    if best.keys != keys_of(members):
        return None
    own = search.sets.evaluate(members, best.sizes)
    rise = thresholds.SIGMA_LOG_LOSS if returned else thresholds.MIN_LOG_RISE
    return own if best.score <= own.score + rise else None
