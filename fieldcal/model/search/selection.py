"""The search for the set of causes with the highest weight."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set, is_function
from fieldcal.model.evidence.sizing import LOG_DENSITY, Member, Sizes
from fieldcal.model.search.offer import Offer, OfferTable
from fieldcal.model.search.offers import MAX_LOG_DISTANCE, Offers
from fieldcal.model.search.pairs import Pair, pair_gains

MIN_LOG_RISE = 0.02
"""Largest rise of ln Z that counts as zero."""

MAX_STEPS = 30
"""Steps of one search."""

EVALUATED_OFFERS = 4
"""Offers that are evaluated in full, at each step."""

PAIRED_CAUSES = 16
"""Causes of which pairs are tried."""

ALTERNATIVE_MARGIN = 6.0
"""Largest predicted distance of alternatives, other parameters or causes, to be
evaluated, ln."""

PREDICTION_SLACK = 3.0
"""Log evidence that a full evaluation may add to the predicted score of an offer."""


class Search(Offers):
    """The search over one Gram matrix."""

    def run(self, start: tuple[Member, ...] = (), thorough: bool = True) -> Set:
        """The set of the highest weight, found step by step from `start`.

        Each step is the first change that raises the weight. Cheap changes are tried
        first: one cause more, one less, or one replaced. Only a `thorough` search tries
        costly changes.
        """
        changes = [self._with_one_more, self._with_one_replaced]
        if thorough:
            changes += [
                self._with_two_more,
                self._without_function,
                self._with_wider_cause,
                self._beside_usual,
            ]
        best = self.evaluate(start)
        for _ in range(MAX_STEPS):
            better = self._step(best, changes)
            if better is best:
                break
            best = better
        return self._prefer_effects(best)

    @property
    def best_visited(self) -> Set:
        """The set of the highest weight of all that were visited."""
        return self._prefer_effects(
            max(self.visited.values(), key=self.corrected_score)
        )

    def drop_superfluous(self, members: tuple[Member, ...]) -> Set:
        """Set of some members without those whose removal raises the weight."""
        best = self.evaluate(members)
        for _ in members:
            less = [self.without(best, i) for i in range(len(best.members))]
            fewer = max(less, key=_score, default=best)
            if fewer.score <= best.score:
                break
            best = fewer
        return best

    def visit_variations(self, there: Set, top: float) -> None:
        """Visit the set with other parameters of each cause, and without each cause.

        An angle that was set wrongly may be that of another position. Only sets are
        visited that are predicted near the weight `top`.
        """
        least = top - ALTERNATIVE_MARGIN
        for i, (cause, group) in enumerate(there.members):
            others = self._variations(there, cause, group)
            if not others:
                continue
            worth = _log_worth(_eliminate_without(there, group), others)
            bare = there.score - worth[group]
            rest = (*there.members[:i], *there.members[i + 1 :])
            if (
                bare - self.set_log_prior(there.members) + self.set_log_prior(rest)
                > least
            ):
                self.without(there, i)
            for other, more in worth.items():
                if other is not group and bare + more > least:
                    members = list(there.members)
                    members[i] = (others[other], other)
                    self.evaluate(tuple(members), there.sizes)

    def _variations(self, there: Set, cause: Cause, group: Group) -> dict[Group, Cause]:
        """The group and what may be in its place, each with its cause."""
        if cause.kind == "effect":
            return dict.fromkeys(group.with_same_shape(cause.variants), cause)
        if cause.position < 0:
            return {}
        return {
            other.variants[0]: other
            for other in self.dictionary.causes
            if other.name_and_part == cause.name_and_part
            and (other is cause or other.key not in there.keys)
        }

    def widen_outputs(self, there: Set) -> Set:
        """The set with its causes on more outputs, if that raises the weight."""
        for cause, group in there.members:
            own = group.with_same_shape(cause.variants)
            some = [g for g in own if {*g.params} > {*group.params}]
            if cause.kind != "effect" or not some:
                continue
            worth = _log_worth(_eliminate_without(there, group), [group, *some])
            most = max(worth, key=lambda g: worth[g])
            if most is not group:
                members = tuple((c, most if c is cause else g)
                                for c, g in there.members)  # fmt: skip
                there = max([there, self.evaluate(members, there.sizes)], key=_score)
        return there

    def _prefer_effects(self, best: Set) -> Set:
        """The best set without unknown functions, if they are unlikely in total.

        The set with the highest weight may contain an unknown function although sets of
        known effects are likelier together.
        """
        if not best.has_unknown_cause:
            return best
        every = list(self.visited.values())
        score = np.array([self.corrected_score(one) for one in every])
        share = np.exp(score - np.logaddexp.reduce(score))
        if share[[one.has_unknown_cause for one in every]].sum() >= thresholds.NAMED:
            return best
        known = (one for one in every if not one.has_unknown_cause)
        return max(known, key=self.corrected_score)

    @staticmethod
    def _step(there: Set, changes: Iterable[Callable[[Set], Set]]) -> Set:
        """The set after the first change that raises its weight, or the set itself."""
        for change in changes:
            better = change(there)
            if better.score > there.score + MIN_LOG_RISE:
                return better
        return there

    def _with_one_replaced(self, there: Set) -> Set:
        """The best set with one cause removed or replaced."""
        best = there
        for i in range(len(there.members)):
            if i >= len(best.members):
                break
            less = self.without(best, i)
            more = self.widen_outputs(less)
            found = [best, more, self._with_one_more(less, best.score, best.sizes)]
            if more is not less:
                # on more outputs, the remaining causes do a part of the removed one's
                found.append(self._with_one_more(more, best.score, best.sizes))
            best = max(found, key=_score)
        return best

    def _with_wider_cause(self, there: Set) -> Set:
        """The best set with all parameters of one of its causes, and one cause more.

        A cause found alone has only the parameters that raise the evidence. With
        another cause it may need all of them.
        """
        found = [there]
        for i, (cause, group) in enumerate(there.members):
            whole = _full_variant(cause, group)
            if whole is not group:
                members = list(there.members)
                members[i] = (cause, whole)
                wide = self.evaluate(tuple(members), there.sizes)
                found.append(self._with_one_more(wide, there.score))
        return max(found, key=_score)

    def _beside_usual(self, there: Set) -> Set:
        """The best set with one cause replaced, in the presence of all usual causes.

        Usual causes are omitted if they do not show. They may not show because another
        cause compensates them, such as a wrong gauge and the scale factor of
        gyroscopes: then neither raises the evidence without the other.
        """
        missing = [
            (c, c.variants[0])
            for c in self.dictionary.causes
            if c.usual and c.key not in there.keys
        ]
        others = {c.key for c, _ in there.members if not c.usual}
        if not (missing and others):
            return there
        whole, found = self.evaluate((*there.members, *missing)), [there]
        near = there.score - ALTERNATIVE_MARGIN
        for i, (cause, _) in enumerate(whole.members):
            if cause.key in others:
                less = self.without(whole, i)
                other = self._with_one_more(less, near, there.sizes)
                if other is not less:
                    found.append(self.drop_superfluous(other.members))
        return max(found, key=_score)

    def _without_function(self, there: Set) -> Set:
        """The best set with two or three causes instead of an unknown function.

        A function of many columns may replace several effects, none of which alone is
        worth as much, and parameters of effects that the set contains. The function
        with the most columns is replaced.
        """
        width = [len(g.columns) * is_function((c, g)) for c, g in there.members]
        if not any(width):
            return there
        less = self.without(there, int(np.argmax(width)))
        two = self._with_two_more(less, there.score)
        found = [there, two, self._with_one_more(two, there.score)]
        whole = self._with_all_their_parameters(less)
        if whole is not less:
            two = self._with_two_more(whole, there.score)
            found += [self._with_one_more(whole, there.score), two]
        return max(found, key=_score)

    def _with_all_their_parameters(self, there: Set) -> Set:
        """The set of the same causes, each with all the parameters that it has."""
        members = tuple((c, _full_variant(c, g)) for c, g in there.members)
        return self.evaluate(members, there.sizes)

    def _with_one_more(
        self, there: Set, level: float | None = None, beside: Sizes | None = None
    ) -> Set:
        """The best set with one cause more; the set itself if none comes near a level.

        The level is the set's own weight if not given.
        """
        level = there.score if level is None else level
        offers = self.offers(there, beside)
        found = [there]
        for offer in offers[:EVALUATED_OFFERS]:
            if (
                offer.score > level - PREDICTION_SLACK
                and offer.score > offers[0].score - MAX_LOG_DISTANCE
            ):
                found.append(self.accept(there, offer))
        return max(found, key=_score)

    def _with_two_more(self, there: Set, level: float | None = None) -> Set:
        """The best set with two causes more, neither of which suffices alone.

        The set itself if none comes near a level, which is its own weight if not given.
        """
        level = there.score if level is None else level
        tried: dict[tuple[str, str], tuple[float, Offer, Offer]] = {}
        for table in self.tables(there):
            if table.instability == there.sizes.instability:
                continue
            least = level - 2 * PREDICTION_SLACK - table.score
            for one, two, worth, (u, v) in self._pairs(there, table, least):
                key = (one.member[0].key, two.member[0].key)
                total = table.score + worth
                if key not in tried or total > tried[key][0]:
                    tried[key] = total, replace(one, size=u), replace(two, size=v)
        near = sorted(tried.values(), key=lambda t: -t[0])[:EVALUATED_OFFERS]
        near = [t for t in near if t[0] > level - 2 * PREDICTION_SLACK]
        found = [self.accept(there, one, two) for _, one, two in near]
        return max(found, key=_score, default=there)

    def _pairs(
        self, there: Set, table: OfferTable, least: float
    ) -> Iterator[tuple[Offer, Offer, float, Pair]]:
        """Pairs of a table's offers, with their worth and the indices of their sizes.

        Offers are also tried with all their parameters. Pairs that are worth less than
        `least` may be omitted.
        """
        known = [o for o in table.offers if not is_function(o.member)][:PAIRED_CAUSES]
        every = [*known, *(_with_all_parameters(o) for o in known)]
        new = [a is not b for a, b in zip(known, every[len(known) :], strict=True)]
        wanted, more = [], {}
        for i, j in combinations(range(len(known)), 2):
            wide = i + new[i] * len(known), j + new[j] * len(known)
            worth = self._log_chance_of_two(there, known[i], known[j])
            for pair in {(i, j), wide}:
                wanted.append(pair)
                more[pair] = worth
        groups, sizes = [o.member[1] for o in every], [o.size for o in every]
        enough = [least - more[pair] for pair in wanted]
        for gain, pair, at in pair_gains(table.state, groups, sizes, wanted, enough):
            yield every[pair[0]], every[pair[1]], gain + more[pair], at

    def _log_chance_of_two(self, there: Set, one: Offer, two: Offer) -> float:
        """Log prior of two more causes, given those of a set."""
        both = [*there.members, one.member, two.member]
        return self.set_log_prior(both) - self.set_log_prior(there.members)


def _eliminate_without(there: Set, group: Group) -> Eliminated:
    """The state of a set without one of its groups, at unchanged sizes."""
    state = there.state
    kept = ~np.isin(state.columns, group.columns)
    return Eliminated.of(state.rows, state.columns[kept], state.prior_sigma[kept])


def _log_worth(rest: Eliminated, some: Iterable[Group]) -> dict[Group, float]:
    """Log evidence that each group adds to a set, averaged over its sizes."""
    worth: dict[Group, float] = {}
    for one in some:
        worth[one] = float(
            np.logaddexp.reduce(
                rest.gain_by_size(one.columns, one.typical) + LOG_DENSITY
            )
        )
    return worth


def _with_all_parameters(offer: Offer) -> Offer:
    """An offer with all the parameters that its cause has."""
    cause, group = offer.member
    whole = _full_variant(cause, group)
    return offer if whole is group else replace(offer, member=(cause, whole))


def _full_variant(cause: Cause, group: Group) -> Group:
    """The variant of a cause with all its parameters, the group itself if it has."""
    whole = cause.variants[0]
    part = not group.shape and set(group.params) < set(whole.params)
    return whole if part else group


def _score(one: Set) -> float:
    return one.score
