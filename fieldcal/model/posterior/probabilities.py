"""Probabilities of causes, and their aliases.

The weight of a visited set is its evidence times its prior probability. Cause B is an
alias of cause A if the best set with B instead of A has nearly the same evidence; prior
probabilities are not used for this. The probability of a cause is the weight of all
sets that contain it or an alias of its kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import fsum

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import thresholds, tolerances
from fieldcal.model.causes.cause import BOTH, Group, triads_of
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.offers import Offer
from fieldcal.model.search.restarts import visit_restart
from fieldcal.model.search.selection import Search
from fieldcal.model.search.variations import visit_variations


@dataclass(frozen=True, slots=True)
class ProbableCause:
    """A cause of the best set that is likelier present than not.

    Attributes
    ----------
    name : of the effect or the unknown function
    members : of the best set with that name
    probability : that it, or an alias of its kind, is present
    aliases : names of its aliases, the likeliest first
    aliases_of_kind : the aliases that are effects like it, or functions without physics
        like it

    """

    name: str
    members: tuple[Member, ...]
    probability: float
    aliases: tuple[str, ...]
    aliases_of_kind: tuple[str, ...] = ()

    @property
    def triads(self) -> frozenset[str]:
        """Triads that it acts on."""
        return frozenset[str]().union(*(triads_of(c.part) for c, _ in self.members))

    @property
    def kind(self) -> str:
        """Kind of the cause."""
        return self.members[0][0].kind


class Posterior:
    """Probabilities of causes, from the sets that a search visited.

    `best` is the best of them; `refined` returns a set with refined time constants.
    """

    def __init__(
        self, search: Search, best: Set, refined: Callable[[Set], Set] | None = None
    ) -> None:
        self.search, self.sets, self.best = search, search.sets, best
        self._refined = refined
        self._nearer: list[tuple[Set, Set]] = []
        names = dict.fromkeys(c.name for c, _ in best.members)
        # noise too: its alternatives are visited, and count in the weights
        alternatives = {name: self._alternatives_to(name) for name in names}
        self.alternatives = {n: alternatives[n] for n in self.cause_names(best)}
        for visited in list(self.sets.visited.values()) if best.members else ():
            if visited.score > best.score - thresholds.AVERAGED_LOG_DISTANCE:
                visit_variations(self.sets, visited, best.score)
        self._visit_likely_additions()
        visit_restart(self.sets, best)

    def _visit_likely_additions(self) -> None:
        """Visit the best set with each further cause that is likely enough.

        A cause that is a little less likely present than absent still widens the
        uncertainty of the calibration. Causes that the rows do not distinguish from the
        calibration are not visited.
        """
        offers = self.search.offers
        shown = offers.shown_in_addition(self.best)
        for offer in offers.ranked(self.best):
            near = offer.score > self.best.score - thresholds.ALTERNATIVE_LOG_DISTANCE
            if near and shown(offer.member[1]):
                offers.accept(self.best, offer)

    @staticmethod
    def cause_names(fitted: Set) -> tuple[str, ...]:
        """Names of the reportable causes of a set, each once."""
        return tuple(dict.fromkeys(c.name for c, _ in fitted.members if c.reportable))

    def without(self, name: str) -> Set:
        """The best set without a cause, on both triads."""
        kept = tuple(m for m in self.best.members if m[0].name != name)
        return self.sets.reduced(self.best, kept)

    def _alternatives_to(self, name: str) -> dict[str, Set]:
        """Sets with another cause instead of one, by the name of the other."""
        less, alternatives = self.without(name), dict[str, Set]()
        parts = {c.part for c, _ in self.best.members if c.name == name}
        own, near = self.evidence(self.best), 0
        offers = self.search.offers.ranked(less, self.best.sizes)
        # predictions are compared with that of the cause itself, not with a fit
        itself = [o for o in offers if o.member[0].name == name]
        predicted = max(
            (self._predicted_evidence(less, o) for o in itself), default=own
        )
        likely = max((o.score for o in itself), default=np.inf)
        for offer in offers:
            cause = offer.member[0]
            behind = predicted - self._predicted_evidence(less, offer)
            # kept if near by evidence alone (an alias), or with its prior (it counts)
            if (
                cause.name == name
                or min(behind, likely - offer.score)
                > thresholds.ALTERNATIVE_LOG_DISTANCE
            ):
                continue
            if (near := near + 1) > tolerances.MAX_ALTERNATIVES:
                break
            alternative = self._with_both_triads(less, offer, parts, offers)
            if not cause.reportable:  # its set counts, but noise is no alias
                continue
            if (
                self._refined_evidence(alternative, own)
                > own - thresholds.ALIAS_LOG_MARGIN
            ):
                if (
                    cause.name not in alternatives
                    or alternative.score > alternatives[cause.name].score
                ):
                    alternatives[cause.name] = alternative
        return alternatives

    def _refined_evidence(self, candidate: Set, own: float) -> float:
        """Evidence of a set; with refined time constants if it is no alias without.

        The best set is refined, so a set on the grid would be at a disadvantage.
        """
        at_points = self.evidence(candidate)
        if self._refined is None or at_points > own - thresholds.ALIAS_LOG_MARGIN:
            return at_points
        if not any(
            _has_time_constant(m[1])
            for m in candidate.members
            if m not in self.best.members
        ):
            return at_points
        nearer = self._refined(candidate)
        self._nearer.append((candidate, nearer))
        return max(at_points, self.evidence(nearer))

    def _predicted_evidence(self, less: Set, offer: Offer) -> float:
        """Predicted `evidence` of a set with an offer."""
        return self._without_chances(offer.score, [*less.members, offer.member])

    def _with_both_triads(
        self, less: Set, offer: Offer, parts: set[str], offers: Sequence[Offer]
    ) -> Set:
        """A set with an offer, also on the other triad if that is better."""
        cause = offer.member[0]
        best = self.search.offers.accept(less, offer)
        for other in offers:
            its = other.member[0]
            if its.name == cause.name and its.part != cause.part and its.part in parts:
                both = self.search.offers.accept(less, offer, other)
                best = max([best, both], key=lambda s: s.score)
        return best

    def evidence(self, candidate: Set) -> float:
        """Log evidence of a set as if its causes were known, and their variants not."""
        return self._without_chances(candidate.score, candidate.members)

    def _without_chances(self, score: float, members: Sequence[Member]) -> float:
        """A score without the prior of its causes; variants are equally probable."""
        counts = sum(
            np.log(self._variants_by_name[c.name_and_part]) for c, _ in members
        )
        return score - self.sets.set_log_prior(members) - float(counts)

    @cached_property
    def _variants_by_name(self) -> Counter[tuple[str, str]]:
        """Number of variants by name and part, summed over positions."""
        counts = Counter[tuple[str, str]]()
        for cause in self.sets.dictionary.causes:
            counts[cause.name_and_part] += len(cause.variants)
        return counts

    def _kind(self, name: str) -> str:
        """Kind of a cause, by its name."""
        causes = self.sets.dictionary.causes
        return next(c.kind for c in causes if c.name == name)

    @cached_property
    def weights(self) -> list[tuple[Set, float]]:
        """Visited sets with their probabilities."""
        sets = [*self.sets.visited.values(), *(s for _, s in self._nearer)]
        score: Array = np.array([self.sets.corrected_score(s) for s in sets])
        share = np.exp(score - score.max())
        share /= share.sum()
        return list(zip(sets, share.tolist(), strict=True))

    @cached_property
    def weights_on_grid(self) -> list[tuple[Set, float]]:
        """The same, with weights of refined sets added to those on the grid.

        Columns of refined sets are not in the dictionary.
        """
        kept = len(self.sets.visited)
        out = dict(self.weights[:kept])
        for (on_grid, _), (_, p) in zip(self._nearer, self.weights[kept:], strict=True):
            out[on_grid] += p
        return list(out.items())

    @property
    def probability_of_noise_alone(self) -> float:
        """Probability that no cause but noise is present."""
        return _sum_of_shares(w for s, w in self.weights if not self.cause_names(s))

    def ranked_causes(self) -> list[tuple[str, float]]:
        """Every cause with its probability, the likeliest first."""
        causes = dict.fromkeys(n for s, _ in self.weights for n in self.cause_names(s))
        ranked = [(name, self.probability([name])) for name in causes]
        return sorted(ranked, key=lambda cause: -cause[1])

    def probability(self, names: Iterable[str], triads: frozenset[str] = BOTH) -> float:
        """Probability that one of some causes is present on one of some triads."""
        wanted = set(names)

        def has_one(some: Set) -> bool:
            named = (c for c, _ in some.members if c.name in wanted)
            return any(triads_of(c.part) & triads for c in named)

        return _sum_of_shares(w for s, w in self.weights if has_one(s))

    def probable_causes(self) -> list[ProbableCause]:
        """Causes of the best set that are likelier present than absent."""
        out = []
        for name in self.cause_names(self.best):
            others = sorted(self.alternatives[name].items(), key=lambda i: -i[1].score)
            names = [n for n, _ in others]
            unknown = self._kind(name) == "unknown"
            of_kind = [n for n in names if (self._kind(n) == "unknown") == unknown]
            members = tuple(m for m in self.best.members if m[0].name == name)
            cause = ProbableCause(name, members, np.nan, tuple(names), tuple(of_kind))
            probability = self.probability([name, *of_kind], cause.triads)
            if probability >= thresholds.NAMED:
                out.append(replace(cause, probability=probability))
        return out


def _sum_of_shares(shares: Iterable[float]) -> float:
    """Sum of probabilities, at most 1."""
    return min(fsum(shares), 1.0)


def _has_time_constant(group: Group) -> bool:
    """Whether a group has a time constant."""
    shapes = group.effect.shapes if group.effect else ()
    return any(s.kind in ("session", "turn", "joint") for s in shapes)
