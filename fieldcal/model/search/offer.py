"""Offers: causes that may be added to a set, each with its predicted score."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Cause
from fieldcal.model.causes.equal_width_groups import EqualWidthGroups
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.instabilities import InstabilityIndices

BestVariants = dict[Cause, tuple[float, int, int]]
"""For each cause: log evidence that it adds, indices of its variant and size."""


@dataclass(frozen=True, slots=True, eq=False)
class Offer:
    """A member that may be added to a set.

    Attributes
    ----------
    member : cause and variant
    score : predicted score of the set with it
    size : index of its most probable size
    instability : indices of the set's instability with it

    """

    member: Member
    score: float
    size: int
    instability: InstabilityIndices

    def with_all_parameters(self) -> Offer:
        """The offer with all parameters that its cause has."""
        cause, group = self.member
        whole = cause.full_variant(group)
        return self if whole is group else replace(self, member=(cause, whole))


@dataclass(frozen=True, slots=True, eq=False)
class OfferTable:
    """Offers to a set at one instability.

    Attributes
    ----------
    instability : its indices
    state, score : of the set at this instability
    offers : the best first

    """

    instability: InstabilityIndices
    state: Eliminated
    score: float
    offers: list[Offer]


def extra_log_odds(
    alike: EqualWidthGroups, log_prior_by_variant: dict[int, Array]
) -> Array:
    """Positive log prior odds of groups, (m,); 0 for those unlikely before the rows.

    A cause that begins in one triad where the device was off also begins in the other,
    whether or not the rows show it.
    """
    out = np.zeros(len(alike.cause))
    for i, shares in log_prior_by_variant.items():
        own = alike.cause == i
        out[own] = np.maximum(shares[alike.variant[own]], 0.0)
    return out


def ranked_offers(
    current: Set, score: float, instability: InstabilityIndices, best: BestVariants
) -> list[Offer]:
    """Offers of causes that a set does not contain, the best first.

    Of causes that differ only in their position, the best one.
    """
    offers = [
        Offer((cause, cause.variants[v]), score + added, size, instability)
        for cause, (added, v, size) in best.items()
        if cause.key not in current.keys
    ]
    best_by_name: dict[tuple[str, str], Offer] = {}
    for offer in sorted(offers, key=lambda o: -o.score):
        best_by_name.setdefault(offer.member[0].name_and_part, offer)
    return [*best_by_name.values()]
