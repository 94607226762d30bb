"""The search for the set of causes that matters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import DENSITY, Member, Sizes
from fieldcal.model.search.offer import Offer, OfferTable
from fieldcal.model.search.offers import NEAR, Offers, gain_of
from fieldcal.model.search.pairs import Pair, pairs

SETTLED = 0.02
"""Rise of ln Z that is none."""

MOST = 30
"""Steps of one search."""

FOLLOWED = 4
"""Offers that are evaluated in full, at each step."""

PROMISING = 16
"""Causes of which pairs are tried."""

OTHERWISE = 6.0
"""How far other parameters of a cause, or what may stand in its place, may be predicted
behind to be looked at, ln."""

SLACK = 3.0
"""Log evidence that a full evaluation may add to the predicted score of an offer."""


class Search(Offers):
    """The search over one Gram matrix."""

    def run(self, start: tuple[Member, ...] = (), thorough: bool = True) -> Set:
        """The set of the highest weight that is found, step by step.

        Each step is the first change that raises the weight, the cheap ones tried
        first: one cause more, one less or another one in its place. Only a `thorough`
        search tries what costs many times as much.
        """
        changes = [self._followed, self._replaced]
        if thorough:
            changes += [self._paired, self._instead, self._wider, self._beside_usual]
        best = self.evaluated(start)
        for _ in range(MOST):
            better = self._step(best, changes)
            if better is best:
                break
            best = better
        return self._of_effects(best)

    @property
    def highest(self) -> Set:
        """The set of the highest weight of all that were visited."""
        return self._of_effects(max(self.visited.values(), key=_score))

    def upheld(self, members: tuple[Member, ...]) -> Set:
        """What of some causes is worth more than less of it."""
        best = self.evaluated(members)
        for _ in members:
            less = [self.without(best, i) for i in range(len(best.members))]
            fewer = max(less, key=_score, default=best)
            if fewer.score <= best.score:
                break
            best = fewer
        return best

    def vary(self, there: Set, top: float) -> None:
        """Visit the set with other parameters of each of its causes, and without it.

        As far as that comes near the weight `top`: which of its parameters an effect
        was given is no more certain than that it is there at all.
        """
        least = top - OTHERWISE
        for i, (cause, group) in enumerate(there.members):
            if cause.kind != "effect":
                continue
            worth = _worth(_rest(there, group), group.siblings(cause.variants))
            bare = there.score - worth[group]
            rest = (*there.members[:i], *there.members[i + 1 :])
            if bare - self.chance(there.members) + self.chance(rest) > least:
                self.without(there, i)
            for other, more in worth.items():
                if other is not group and bare + more > least:
                    members = list(there.members)
                    members[i] = (cause, other)
                    self.evaluated(tuple(members), there.sizes)

    def on_more_outputs(self, there: Set) -> Set:
        """A set with its causes on more outputs, where those raise the weight.

        What a further cause did on an output may be what another one does there, too.
        """
        for cause, group in there.members:
            own = group.siblings(cause.variants)
            some = [g for g in own if {*g.params} > {*group.params}]
            if cause.kind != "effect" or not some:
                continue
            worth = _worth(_rest(there, group), [group, *some])
            most = max(worth, key=lambda g: worth[g])
            if most is not group:
                members = tuple((c, most if c is cause else g)
                                for c, g in there.members)  # fmt: skip
                there = max([there, self.evaluated(members, there.sizes)], key=_score)
        return there

    def _of_effects(self, best: Set) -> Set:
        """The best set of effects alone, where that it is no effect is unlikely.

        Alone it may be the likeliest, and still several effects that do the same,
        each a little less likely, are likelier together: those are to be told.
        """
        if not strange(best):
            return best
        every = list(self.visited.values())
        score = np.array([one.score for one in every])
        share = np.exp(score - np.logaddexp.reduce(score))
        if share[[strange(one) for one in every]].sum() >= thresholds.NAMED:
            return best
        return max((one for one in every if not strange(one)), key=_score)

    @staticmethod
    def _step(there: Set, changes: Iterable[Callable[[Set], Set]]) -> Set:
        """The set after the first change that raises its weight, or the set itself."""
        for change in changes:
            better = change(there)
            if better.score > there.score + SETTLED:
                return better
        return there

    def _replaced(self, there: Set) -> Set:
        """The best set with one cause less, or with another one in its place."""
        best = there
        for i in range(len(there.members)):
            if i >= len(best.members):
                break
            less = self.without(best, i)
            more = self.on_more_outputs(less)
            found = [best, more, self._followed(less, best.score, best.sizes)]
            if more is not less:
                # on more outputs, what is left does a part of what was left out
                found.append(self._followed(more, best.score, best.sizes))
            best = max(found, key=_score)
        return best

    def _wider(self, there: Set) -> Set:
        """The best set with all the parameters of one of its causes and one more.

        By itself a cause gets the parameters that raise the evidence and stand in for
        others. Beside another cause it may need all of them, and only then does the
        other one raise the evidence.
        """
        found = [there]
        for i, (cause, group) in enumerate(there.members):
            whole = _whole(cause, group)
            if whole is not group:
                members = list(there.members)
                members[i] = (cause, whole)
                wide = self.evaluated(tuple(members), there.sizes)
                found.append(self._followed(wide, there.score))
        return max(found, key=_score)

    def _beside_usual(self, there: Set) -> Set:
        """The best set with another cause in the place of one, beside what is usual.

        What every device has is left out where it does not show. It may not show as
        another cause does the opposite, such as a gauge that is as long as gyroscopes
        are weak: neither of the two then raises the evidence without the other.
        """
        missing = [
            (c, c.variants[0])
            for c in self.dictionary.causes
            if c.usual and c.key not in there.keys
        ]
        others = {c.key for c, _ in there.members if not c.usual}
        if not (missing and others):
            return there
        whole, found = self.evaluated((*there.members, *missing)), [there]
        near = there.score - OTHERWISE
        for i, (cause, _) in enumerate(whole.members):
            if cause.key in others:
                less = self.without(whole, i)
                other = self._followed(less, near, there.sizes)
                if other is not less:
                    found.append(self.upheld(other.members))
        return max(found, key=_score)

    def _instead(self, there: Set) -> Set:
        """The best set with two or three causes in the place of one without physics.

        A function of many columns does for what several effects make together, of which
        none alone is worth as much: that of the most columns, when nothing else helps.
        """
        width = [len(g.columns) * is_function((c, g)) for c, g in there.members]
        if not any(width):
            return there
        less = self.without(there, int(np.argmax(width)))
        two = self._paired(less, there.score)
        return max([there, two, self._followed(two, there.score)], key=_score)

    def _followed(
        self, there: Set, level: float | None = None, beside: Sizes | None = None
    ) -> Set:
        """The best set with one more; the set itself if none comes near a level.

        That is the set's own weight if it is not given.
        """
        level = there.score if level is None else level
        offers = self.offers(there, beside)
        found = [there]
        for offer in offers[:FOLLOWED]:
            if offer.score > level - SLACK and offer.score > offers[0].score - NEAR:
                found.append(self.taken(there, offer))
        return max(found, key=_score)

    def _paired(self, there: Set, level: float | None = None) -> Set:
        """The best set with two more, of which neither raises the evidence by itself.

        The set itself if none comes near a level, its own weight if not given.
        """
        level = there.score if level is None else level
        tried: dict[tuple[str, str], tuple[float, Offer, Offer]] = {}
        for table in self.tables(there):
            if table.less == there.sizes.instability:
                continue
            least = level - 2 * SLACK - table.score
            for one, two, worth, (u, v) in self._pairs(there, table, least):
                key = (one.member[0].key, two.member[0].key)
                total = table.score + worth
                if key not in tried or total > tried[key][0]:
                    tried[key] = total, replace(one, size=u), replace(two, size=v)
        near = sorted(tried.values(), key=lambda t: -t[0])[:FOLLOWED]
        near = [t for t in near if t[0] > level - 2 * SLACK]
        found = [self.taken(there, one, two) for _, one, two in near]
        return max(found, key=_score, default=there)

    def _pairs(
        self, there: Set, table: OfferTable, least: float
    ) -> Iterator[tuple[Offer, Offer, float, Pair]]:
        """Every two offers of a table with their worth, and the sizes that it is at.

        Each with all its parameters as well: beside the other it may need them. Pairs
        that are worth less than the least may be left out.
        """
        known = [o for o in table.offers if not is_function(o.member)][:PROMISING]
        every = [*known, *(_widened(o) for o in known)]
        new = [a is not b for a, b in zip(known, every[len(known) :], strict=True)]
        wanted, more = [], {}
        for i, j in combinations(range(len(known)), 2):
            wide = i + new[i] * len(known), j + new[j] * len(known)
            worth = self._more(there, known[i], known[j])
            for pair in {(i, j), wide}:
                wanted.append(pair)
                more[pair] = worth
        groups, sizes = [o.member[1] for o in every], [o.size for o in every]
        enough = [least - more[pair] for pair in wanted]
        for gain, pair, at in pairs(table.state, groups, sizes, wanted, enough):
            yield every[pair[0]], every[pair[1]], gain + more[pair], at

    def _more(self, there: Set, one: Offer, two: Offer) -> float:
        """Chance of two more causes beside those of a set, ln."""
        both = [*there.members, one.member, two.member]
        return self.chance(both) - self.chance(there.members)


def _rest(there: Set, group: Group) -> Eliminated:
    """What is left by a set without one of its groups, with the sizes as they are."""
    state = there.state
    kept = ~np.isin(state.columns, group.columns)
    return Eliminated.of(state.rows, state.columns[kept], state.sizes[kept])


def _worth(rest: Eliminated, some: Iterable[Group]) -> dict[Group, float]:
    """What each of some groups adds to a set, ln, over all its sizes."""
    worth: dict[Group, float] = {}
    for one in some:
        worth[one] = float(np.logaddexp.reduce(gain_of(rest, one) + DENSITY))
    return worth


def _widened(offer: Offer) -> Offer:
    """An offer with all the parameters that its cause has."""
    cause, group = offer.member
    whole = _whole(cause, group)
    return offer if whole is group else replace(offer, member=(cause, whole))


def _whole(cause: Cause, group: Group) -> Group:
    """The variant of a cause with all its parameters, the group itself if it has."""
    whole = cause.variants[0]
    part = not group.shape and set(group.params) < set(whole.params)
    return whole if part else group


def is_function(member: Member) -> bool:
    """Whether a member is a function of the rows that no effect makes.

    One window off by itself is none: it does for nothing but itself. Far off it hides
    every effect, and what the effects leave hides that it is one window alone.
    """
    cause, group = member
    return cause.kind == "unknown" and len(group.columns) > 1


def strange(one: Set) -> bool:
    """Whether a set has a cause that is no effect."""
    return any(cause.kind == "unknown" for cause, _ in one.members)


def _score(one: Set) -> float:
    return one.score
