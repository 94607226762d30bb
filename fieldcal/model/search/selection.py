"""The search for the set of causes with the highest weight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from fieldcal.model import thresholds, tolerances
from fieldcal.model.evidence.sets import Set, Sets, is_function
from fieldcal.model.evidence.sizing import Member, Sizes
from fieldcal.model.search.offers import Offer, Offers
from fieldcal.model.search.pairs import OfferedPair, offered_pairs
from fieldcal.model.search.variations import (
    drop_superfluous,
    score_of,
    widen_outputs,
    with_all_parameters,
)


def is_exhausted(best: Set) -> bool:
    """Whether a search ended at a set of so many causes that none of them counts."""
    return len(best.members) >= thresholds.MAX_CAUSES


class Search:
    """The search over one Gram matrix, with the sets visited, and offers to any set."""

    def __init__(self, sets: Sets) -> None:
        self.sets, self.offers = sets, Offers(sets)

    def run(self, start: tuple[Member, ...] = (), thorough: bool = True) -> Set:
        """The set of the highest weight, found step by step from `start`.

        Each step is the first change that raises the weight. Cheap changes are tried
        first: one cause more, one less, or one replaced. Only a `thorough` search tries
        costly changes.
        """
        changes = [self._with_one_more, self._with_one_replaced]
        if thorough:
            changes += [
                self._with_both_parts_replaced,
                self._with_two_more,
                self._with_one_for_two,
                self._with_two_for_one,
                self._without_function,
                self._with_wider_cause,
                self._with_usual_causes,
            ]
        best = self.sets.evaluate(start)
        for _ in range(tolerances.MAX_ITERATIONS):
            better = self._step(best, changes)
            if better is best:
                break
            best = better
            if is_exhausted(best):
                break
        return self._prefer_effects(best)

    @property
    def best_visited(self) -> Set:
        """The set of the highest weight of all that were visited."""
        return self._prefer_effects(
            max(self.sets.visited.values(), key=self.sets.corrected_score)
        )

    def _prefer_effects(self, best: Set) -> Set:
        """The best set without unknown functions, if they are unlikely in total.

        The set with the highest weight may contain an unknown function although sets of
        known effects are likelier together.
        """
        if not best.has_unknown_cause:
            return best
        visited = list(self.sets.visited.values())
        score = np.array([self.sets.corrected_score(s) for s in visited])
        share = np.exp(score - np.logaddexp.reduce(score))
        if share[[s.has_unknown_cause for s in visited]].sum() >= thresholds.NAMED:
            return best
        known = (s for s in visited if not s.has_unknown_cause)
        return max(known, key=self.sets.corrected_score)

    @staticmethod
    def _step(current: Set, changes: Iterable[Callable[[Set], Set]]) -> Set:
        """The set after the first change that raises its weight, or the set itself."""
        for change in changes:
            better = change(current)
            if better.score > current.score + thresholds.MIN_LOG_RISE:
                return better
        return current

    def _with_one_more(
        self, current: Set, level: float | None = None, other_sizes: Sizes | None = None
    ) -> Set:
        """The best set with one cause more; the set itself if none comes near a level.

        The level is the set's own weight if not given. `other_sizes` are as in
        `Offers.ranked`.
        """
        level = current.score if level is None else level
        offers = self.offers.ranked(current, other_sizes)
        tried = [current]
        for offer in _leading(offers):
            if offer.score > level - thresholds.PREDICTION_SLACK:
                tried.append(self.offers.accept(current, offer))
        return max(tried, key=score_of)

    def _with_two_more(
        self, current: Set, level: float | None = None, other_sizes: Sizes | None = None
    ) -> Set:
        """The best set with two causes more, neither of which suffices alone.

        The set itself if none comes near a level, which is its own weight if not given.
        `other_sizes` are as in `Offers.ranked`.
        """
        level = current.score if level is None else level
        least = level - 2 * thresholds.PREDICTION_SLACK
        best: dict[tuple[str, str], OfferedPair] = {}
        for table in self.offers.tables(current, other_sizes):
            if table.instability == current.sizes.instability:
                continue
            for pair in offered_pairs(self.sets, current, table, least):
                if pair.keys not in best or pair.score > best[pair.keys].score:
                    best[pair.keys] = pair
        ranked = sorted(best.values(), key=lambda pair: -pair.score)
        tried = [
            self.offers.accept(current, pair.first, pair.second)
            for pair in ranked[: tolerances.EVALUATED]
            if pair.score > least
        ]
        return max(tried, key=score_of, default=current)

    def _with_one_replaced(self, current: Set) -> Set:
        """The best set with one cause removed or replaced."""
        best = current
        for i in range(len(current.members)):
            if i >= len(best.members):
                break
            reduced = self.sets.without(best, i)
            wider = widen_outputs(self.sets, reduced)
            tried = [best, wider, self._with_one_more(reduced, best.score, best.sizes)]
            if wider is not reduced:
                # on more outputs, the remaining causes do a part of the removed one's
                tried.append(self._with_one_more(wider, best.score, best.sizes))
            best = max(tried, key=score_of)
        return best

    def _with_both_parts_replaced(self, current: Set) -> Set:
        """The best set with an effect of both triads replaced by another in both.

        With one triad alone replaced, neither effect has the other triad beside it.
        """
        tried = [current]
        names = Counter(cause.name for cause, _ in current.members if cause.part)
        for name in (name for name, parts in names.items() if parts > 1):
            first = self._place(current, name)
            reduced = self.sets.without(current, first)
            for offer in _leading(self.offers.ranked(reduced, current.sizes)):
                other = offer.member[0].name
                if other == name:
                    continue
                mixed = self.offers.accept(reduced, offer)
                rest = self.sets.without(mixed, self._place(mixed, name))
                offers = self.offers.ranked(rest, mixed.sizes)
                same = (o for o in offers if o.member[0].name == other)
                if found := next(same, None):
                    tried.append(self.offers.accept(rest, found))
        return max(tried, key=score_of)

    @staticmethod
    def _place(current: Set, name: str) -> int:
        """Index of the first member of a name."""
        return next(i for i, (c, _) in enumerate(current.members) if c.name == name)

    def _with_one_for_two(self, current: Set) -> Set:
        """The best set with one cause replaced, and without what is not needed then.

        Beside a cause that is not there, another may stand for what it lacks: beside a
        jump of a bias a wrong angle of the next position, where the device has slipped.
        """
        tried, level = [current], current.score - thresholds.ALTERNATIVE_LOG_DISTANCE
        for i, (cause, _) in enumerate(current.members):
            reduced = self.sets.without(current, i)
            for offer in _leading(self.offers.ranked(reduced, current.sizes)):
                if offer.member[0].key != cause.key:
                    other = self.offers.accept(reduced, offer)
                    if other.score > level:
                        tried.append(drop_superfluous(self.sets, other.members))
        return max(tried, key=score_of)

    def _with_two_for_one(self, current: Set) -> Set:
        """The best set with two causes instead of one, neither of which suffices alone.

        A cross-coupling may stand for a quadratic term and a slip of the mount.
        """
        tried, level = [current], current.score - thresholds.ALTERNATIVE_LOG_DISTANCE
        for i in range(len(current.members)):
            reduced = self.sets.without(current, i)
            tried.append(self._with_two_more(reduced, level, current.sizes))
        return max(tried, key=score_of)

    def _with_wider_cause(self, current: Set) -> Set:
        """The best set with all parameters of one of its causes, and one cause more.

        A cause found alone has only the parameters that raise the evidence. With
        another cause it may need all of them.
        """
        tried = [current]
        for i, (cause, group) in enumerate(current.members):
            whole = cause.full_variant(group)
            if whole is not group:
                members = list(current.members)
                members[i] = (cause, whole)
                wide = self.sets.evaluate(tuple(members), current.sizes)
                tried.append(self._with_one_more(wide, current.score))
        return max(tried, key=score_of)

    def _with_usual_causes(self, current: Set) -> Set:
        """The best set with one cause replaced, in the presence of all usual causes.

        Usual causes are omitted if they do not show. They may not show because another
        cause compensates them, such as a wrong gauge and the scale factor of
        gyroscopes: then neither raises the evidence without the other.
        """
        missing = [
            (c, c.variants[0])
            for c in self.sets.dictionary.causes
            if c.usual and c.key not in current.keys
        ]
        unusual = {c.key for c, _ in current.members if not c.usual}
        if not (missing and unusual):
            return current
        tried = [current]
        complete = self.sets.evaluate((*current.members, *missing))
        level = current.score - thresholds.ALTERNATIVE_LOG_DISTANCE
        for i, (cause, _) in enumerate(complete.members):
            if cause.key in unusual:
                reduced = self.sets.without(complete, i)
                replaced = self._with_one_more(reduced, level, current.sizes)
                if replaced is not reduced:
                    tried.append(drop_superfluous(self.sets, replaced.members))
        return max(tried, key=score_of)

    def _without_function(self, current: Set) -> Set:
        """The best set with two or three causes instead of an unknown function.

        A function of many columns may replace several effects, none of which alone is
        worth as much, and parameters of effects that the set contains. The function
        with the most columns is replaced.
        """
        width = [len(g.columns) * is_function((c, g)) for c, g in current.members]
        if not any(width):
            return current
        reduced = self.sets.without(current, int(np.argmax(width)))
        two = self._with_two_more(reduced, current.score)
        tried = [current, two, self._with_one_more(two, current.score)]
        complete = with_all_parameters(self.sets, reduced)
        if complete is not reduced:
            two = self._with_two_more(complete, current.score)
            tried += [self._with_one_more(complete, current.score), two]
        return max(tried, key=score_of)


def _leading(offers: Sequence[Offer]) -> list[Offer]:
    """The best of ranked offers, as far as they are near the best one."""
    return [
        offer
        for offer in offers[: tolerances.EVALUATED]
        if offer.score > offers[0].score - thresholds.OFFERED_LOG_DISTANCE
    ]
