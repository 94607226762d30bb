"""Pairs of causes that are offered to a set, with the log evidence that they add."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

from fieldcal.model.evidence.sets import Set, Sets, is_function
from fieldcal.model.search.offer import Offer, OfferTable
from fieldcal.model.search.pairs import pair_gains

PAIRED_CAUSES = 16
"""Causes of which pairs are tried."""


@dataclass(frozen=True, slots=True, eq=False)
class OfferedPair:
    """Two offers that are added to a set together.

    Attributes
    ----------
    first, second : the offers, each at its most probable size beside the other
    score : predicted score of the set with both

    """

    first: Offer
    second: Offer
    score: float

    @property
    def keys(self) -> tuple[str, str]:
        """Keys of the two causes."""
        return self.first.member[0].key, self.second.member[0].key


def offered_pairs(
    sets: Sets, current: Set, table: OfferTable, least: float
) -> Iterator[OfferedPair]:
    """Pairs of a table's offers; those with a score below `least` may be omitted.

    Offers are also tried with all their parameters.
    """
    narrow = [o for o in table.offers if not is_function(o.member)][:PAIRED_CAUSES]
    offers = [*narrow, *(o.with_all_parameters() for o in narrow)]
    count = len(narrow)
    widened = [a is not b for a, b in zip(narrow, offers[count:], strict=True)]
    pairs, log_prior = [], {}
    for i, j in combinations(range(count), 2):
        wide = i + widened[i] * count, j + widened[j] * count
        both = [*current.members, narrow[i].member, narrow[j].member]
        chance = sets.set_log_prior(both) - sets.set_log_prior(current.members)
        for pair in {(i, j), wide}:
            pairs.append(pair)
            log_prior[pair] = chance
    groups, sizes = [o.member[1] for o in offers], [o.size for o in offers]
    enough = [least - table.score - log_prior[pair] for pair in pairs]
    for gain, pair, (u, v) in pair_gains(table.state, groups, sizes, pairs, enough):
        first, second = (offers[i] for i in pair)
        yield OfferedPair(
            replace(first, size=u),
            replace(second, size=v),
            table.score + (gain + log_prior[pair]),
        )
