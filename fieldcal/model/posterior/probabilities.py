"""Probabilities: of each cause, of what may stand in its place, of a verdict.

The sets that were visited are weighted by evidence times chance. Another cause is an
alias of one that was found when the best set with it instead has an evidence that is
not clearly less, whatever the chances before; the probability that something is there
counts the sets with an alias of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import fsum

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import BOTH, Group, triads_of
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.posterior.mixture import KEPT
from fieldcal.model.search.offer import Offer
from fieldcal.model.search.selection import OTHERWISE, Search


@dataclass(frozen=True, slots=True)
class Standing:
    """A cause of the best set.

    Attributes
    ----------
    name : of the effect or the unknown function
    members : of the best set with that name
    probability : that it, or an alias of it, is there
    aliases : names of what may stand in its place, the likeliest first

    """

    name: str
    members: tuple[Member, ...]
    probability: float
    aliases: tuple[str, ...]

    @property
    def triads(self) -> frozenset[str]:
        """Those that it is on."""
        return frozenset[str]().union(*(triads_of(c.part) for c, _ in self.members))

    @property
    def kind(self) -> str:
        """Of the cause."""
        return self.members[0][0].kind


class Posterior:
    """What a search says of causes.

    Parameters
    ----------
    search : with the sets that it visited
    best : of them
    refined : a set with the time constants of what others have not where they fit best

    """

    def __init__(
        self, search: Search, best: Set, refined: Callable[[Set], Set] | None = None
    ) -> None:
        self.search, self.best, self._refined = search, best, refined
        self._nearer: list[tuple[Set, Set]] = []
        every = dict.fromkeys(c.name for c, _ in best.members)
        instead = {name: self._instead(name) for name in every}
        self.instead = {name: instead[name] for name in self.names(best)}
        for one in list(search.visited.values()) if best.members else ():
            if one.score > best.score - KEPT:
                search.vary(one, best.score)
        self._one_more()

    def _one_more(self) -> None:
        """Visit the best set with each cause more that comes near.

        A cause that is a little less likely there than not is not excluded: a drift
        that nobody would name makes what a device starts with less certain. What no
        row tells from the calibration is left to what is stated.
        """
        shown = self.search.shown_by(self.best)
        for offer in self.search.offers(self.best):
            near = offer.score > self.best.score - OTHERWISE
            if near and shown(offer.member[1]):
                self.search.taken(self.best, offer)

    @staticmethod
    def names(some: Set) -> tuple[str, ...]:
        """Names of the causes of a set that are told, each once."""
        return tuple(dict.fromkeys(c.name for c, _ in some.members if c.told))

    def without(self, name: str) -> Set:
        """The best set without a cause, on both triads."""
        kept = tuple(m for m in self.best.members if m[0].name != name)
        return self.search.evaluated(kept, self.search.sizes_of(self.best, kept))

    def _instead(self, name: str) -> dict[str, Set]:
        """Sets with other causes in the place of one, by their names."""
        less, found = self.without(name), dict[str, Set]()
        parts = {c.part for c, _ in self.best.members if c.name == name}
        own, near = self.evidence(self.best), 0
        offers = self.search.offers(less, self.best.sizes)
        # what is predicted beside what is left is less than the whole: alike for all
        itself = [o for o in offers if o.member[0].name == name]
        predicted = max((self._bare(less, o) for o in itself), default=own)
        likely = max((o.score for o in itself), default=np.inf)
        for offer in offers:
            cause = offer.member[0]
            behind = predicted - self._bare(less, offer)
            # by its evidence it is an alias, by its chance as well it counts
            if cause.name == name or min(behind, likely - offer.score) > OTHERWISE:
                continue
            if (near := near + 1) > LOOKED_AT:
                break
            there = self._whole(less, offer, parts, offers)
            if not cause.told:  # it counts, and is no name for anything
                continue
            if self._at_best(there, own) > own - thresholds.SAME:
                if cause.name not in found or there.score > found[cause.name].score:
                    found[cause.name] = there
        return found

    def _at_best(self, there: Set, own: float) -> float:
        """Evidence of a set, between the points of its grids if on them it is no alias.

        What was found has been refined: beside it a grid is too coarse.
        """
        at_points = self.evidence(there)
        if self._refined is None or at_points > own - thresholds.SAME:
            return at_points
        if not any(_fades(m[1]) for m in there.members if m not in self.best.members):
            return at_points
        nearer = self._refined(there)
        self._nearer.append((there, nearer))
        return max(at_points, self.evidence(nearer))

    def _bare(self, less: Set, offer: Offer) -> float:
        """Foretold evidence of a set with an offer, without the chances, ln."""
        return offer.score - self.search.chance([*less.members, offer.member])

    def _whole(
        self, less: Set, offer: Offer, parts: set[str], offers: Sequence[Offer]
    ) -> Set:
        """A set with an offer, with its other triad where that is better."""
        cause = offer.member[0]
        there = self.search.taken(less, offer)
        for other in offers:
            its = other.member[0]
            if its.name == cause.name and its.part != cause.part and its.part in parts:
                both = self.search.taken(less, offer, other)
                there = max([there, both], key=lambda s: s.score)
        return there

    def evidence(self, there: Set) -> float:
        """Of a set, ln, without the chances of its causes; variants count alike."""
        counts = sum(np.log(len(c.variants)) for c, _ in there.members)
        return there.score - self.search.chance(there.members) - float(counts)

    def _kind(self, name: str) -> str:
        """Of a cause by its name."""
        causes = self.search.dictionary.causes
        return next(c.kind for c in causes if c.name == name)

    @cached_property
    def weights(self) -> list[tuple[Set, float]]:
        """Sets visited, with their probabilities."""
        sets = [*self.search.visited.values(), *(s for _, s in self._nearer)]
        score: Array = np.array([s.score for s in sets])
        share = np.exp(score - score.max())
        share /= share.sum()
        return list(zip(sets, share.tolist(), strict=True))

    @cached_property
    def at_points(self) -> list[tuple[Set, float]]:
        """The same at the points of the grids, whose columns the dictionary has."""
        kept = len(self.search.visited)
        out = dict(self.weights[:kept])
        for (there, _), (_, p) in zip(self._nearer, self.weights[kept:], strict=True):
            out[there] += p
        return list(out.items())

    @property
    def nothing(self) -> float:
        """Probability that there is nothing but noise."""
        return _total(w for s, w in self.weights if not self.names(s))

    def suspects(self) -> list[tuple[str, float]]:
        """Every cause with its probability, the likeliest first."""
        causes = dict.fromkeys(n for s, _ in self.weights for n in self.names(s))
        each = [(name, self.probability([name])) for name in causes]
        return sorted(each, key=lambda one: -one[1])

    def probability(self, names: Iterable[str], triads: frozenset[str] = BOTH) -> float:
        """That one of some causes is there, on one of some triads.

        What stands on the gyroscopes does not stand for what is on accelerometers.
        """
        wanted = set(names)
        return _total(
            w
            for s, w in self.weights
            if any(
                c.name in wanted and triads_of(c.part) & triads for c, _ in s.members
            )
        )

    def standing(self) -> list[Standing]:
        """Causes of the best set, as far as they are likelier there than not."""
        out = []
        for name in self.names(self.best):
            others = sorted(self.instead[name].items(), key=lambda i: -i[1].score)
            names = [n for n, _ in others]
            strange = self._kind(name) == "unknown"
            alike = [n for n in names if not strange or self._kind(n) == "unknown"]
            members = tuple(m for m in self.best.members if m[0].name == name)
            one = Standing(name, members, np.nan, tuple(names))
            probability = self.probability([name, *alike], one.triads)
            if probability >= thresholds.NAMED:
                out.append(replace(one, probability=probability))
        return out


def _total(shares: Iterable[float]) -> float:
    """Sum of some shares, rounded to no more than all."""
    return min(fsum(shares), 1.0)


def _fades(group: Group) -> bool:
    """Whether a group has a time constant."""
    shapes = group.effect.shapes if group.effect else ()
    return any(s.kind in ("session", "turn", "joint") for s in shapes)


LOOKED_AT = 8
"""Causes that are tried in the place of one: further ones are worse."""
