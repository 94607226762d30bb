"""Offers: every cause that is not in a set, with the log evidence it would add.

A cause is offered at its best variant and size, at the set's instability and at smaller
ones of one triad, since a scatter that the cause explains is no longer instability. The
instability of the other triad is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fieldcal.core.samples import ACC, CHANNELS, Array
from fieldcal.model import priors, resolutions, thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.equal_width_groups import EqualWidthGroups
from fieldcal.model.evidence.eliminated import Eliminated, noticeable_gains
from fieldcal.model.evidence.sets import Set, SetKey, Sets, variant_log_priors
from fieldcal.model.evidence.sizing import LOG_DENSITY, UNIT_INDEX, Member, Sizes
from fieldcal.model.search.group_gains import GroupGains
from fieldcal.model.search.set_at_instability import (
    InstabilityIndices,
    SetAtInstability,
    at_tried_instabilities,
    permanent_groups,
)

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
    calibration, instability : indices of the set's sizes with it

    """

    member: Member
    score: float
    size: int
    calibration: tuple[int, ...]
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

    @classmethod
    def of(cls, current: Set, level: SetAtInstability, best: BestVariants) -> Self:
        """Offers of the best variants that a set does not contain, the best first."""
        offers = ranked_offers(current, level, best)
        return cls(level.instability, level.state, level.score, offers)


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
    current: Set, level: SetAtInstability, best: BestVariants
) -> list[Offer]:
    """Offers of causes that a set does not contain, the best first.

    Of causes that differ only in their position, the best one.
    """
    offers = [
        Offer(
            (cause, cause.variants[v]),
            level.score + added,
            size,
            level.calibration,
            level.instability,
        )
        for cause, (added, v, size) in best.items()
        if cause.key not in current.keys
    ]
    best_by_name: dict[tuple[str, str], Offer] = {}
    for offer in sorted(offers, key=lambda o: -o.score):
        best_by_name.setdefault(offer.member[0].name_and_part, offer)
    return [*best_by_name.values()]


def _moved(own: tuple[int, ...], *offered: tuple[int, ...]) -> tuple[int, ...]:
    """Sizes that several offers move, all of them up or down."""
    return tuple(
        max(sizes) if max(sizes) > before else min(sizes)
        for before, *sizes in zip(own, *offered, strict=True)
    )


OfferKey = tuple[SetKey, Sizes | None]
"""Key of a set, and the sizes to which its offers are restricted, if any."""

FLICKER_OUTPUTS = len(CHANNELS[ACC])
"""Outputs of a group of flicker: those of a triad."""


class Offers:
    """Finds the causes that may be added to a set, and predicts scores with them."""

    def __init__(self, sets: Sets) -> None:
        self.sets = sets
        self._gains = GroupGains(sets)
        self._tables: dict[OfferKey, list[OfferTable]] = {}

    def ranked(self, current: Set, other_sizes: Sizes | None = None) -> list[Offer]:
        """Every cause that a set does not contain, at its best variant, the best first.

        Of causes that differ only in their position, the best one.

        With `other_sizes`, the sizes of another set, only its instability and flicker
        are tried besides the set's own: a cause that replaces a removed one needs them.
        """
        best: dict[tuple[str, str], Offer] = {}
        for table in self.tables(current, other_sizes):
            for leading in table.offers:
                offer = self._evaluate_all_columns(current, leading, table)
                name = leading.member[0].name_and_part
                if name not in best or offer.score > best[name].score:
                    best[name] = offer
        return sorted(best.values(), key=lambda o: -o.score)

    def tables(
        self, current: Set, other_sizes: Sizes | None = None
    ) -> list[OfferTable]:
        """Offers to a set at each of some instabilities; cached."""
        key = self.sets.key(current.members)
        other_sizes = other_sizes and replace(other_sizes, members=())
        offer_key = key, None if (key, None) in self._tables else other_sizes
        if offer_key not in self._tables:
            levels = list(at_tried_instabilities(self.sets, current, other_sizes))
            best = self._best_variants(levels, *self.cause_log_priors(current))
            self._tables[offer_key] = [
                OfferTable.of(current, level, variants)
                for level, variants in zip(levels, best, strict=True)
            ]
        return self._tables[offer_key]

    def accept(self, current: Set, *offers: Offer) -> Set:
        """The set with the offered members, from the sizes at which they gain most.

        From the set's own sizes, flicker would keep what a member explains better.
        """
        sizes = current.sizes
        calibration = _moved(sizes.calibration, *(o.calibration for o in offers))
        instability = _moved(sizes.instability, *(o.instability for o in offers))
        added = (o.size for o in offers)
        start = Sizes(calibration, instability, (*sizes.members, *added))
        return self.sets.evaluate(
            (*current.members, *(o.member for o in offers)), start
        )

    def shown_in_addition(self, current: Set) -> Callable[[Group], bool]:
        """Test whether rows show a group in addition to a set and a free calibration.

        In two positions every cause looks like bias and scale factor; only their prior
        would distinguish it.
        """
        state = current.state
        prior_sigma = state.prior_sigma.copy()
        for group, place, _ in permanent_groups(self.sets.dictionary, current):
            if group.in_state and group.fixed_size is None:
                prior_sigma[place] = group.prior_sigma(priors.FREE_SIZE)
        free = Eliminated.of(state.rows, state.columns, prior_sigma)

        def is_shown(group: Group) -> bool:
            gains = free.gain_by_size(group.columns, group.typical)
            return bool(gains.max() >= thresholds.SIGMA_LOG_LOSS)

        return is_shown

    def cause_log_priors(self, current: Set) -> tuple[Array, dict[int, Array]]:
        """Log prior of every cause given a set; for each variant where they differ."""
        events = {c.event for c, _ in current.members}
        usual = any(c.usual for c, _ in current.members)
        log_prior = self.sets.dictionary.cause_log_priors.copy()
        log_prior_by_variant: dict[int, Array] = {}
        for i, cause in enumerate(self.sets.dictionary.causes):
            if cause.event in events or cause.expected or (usual and cause.usual):
                shares = variant_log_priors(cause, current.members)
                log_prior[i] = shares.min()
                if shares.ndim:
                    log_prior_by_variant[i] = shares
        return log_prior, log_prior_by_variant

    def _evaluate_all_columns(
        self, current: Set, offer: Offer, table: OfferTable
    ) -> Offer:
        """An offer recalculated with all columns of its group, if it has many.

        Random walks and flicker far above the noise need more than the leading columns.
        """
        group = offer.member[1]
        outputs = FLICKER_OUTPUTS if group.random else len(group.params)
        if not outputs or len(group.columns) <= resolutions.COSINES * outputs:
            return offer
        profile = LOG_DENSITY + table.state.gain_by_size(group.columns, group.typical)
        log_prior = self.sets.set_log_prior([*current.members, offer.member])
        added = float(np.logaddexp.reduce(profile)) + log_prior
        score = table.score + added - self.sets.set_log_prior(current.members)
        return replace(offer, score=score, size=int(np.argmax(profile)))

    def _best_variants(
        self,
        levels: Sequence[SetAtInstability],
        log_prior: Array,
        log_prior_by_variant: dict[int, Array],
    ) -> list[BestVariants]:
        """Best variant of every cause at each level of a set."""
        best: list[BestVariants] = [{} for _ in levels]
        for alike, inner, rhs, top in self._gains.by_width(levels):
            at = alike.cause
            least = thresholds.SIGMA_LOG_LOSS - extra_log_odds(
                alike, log_prior_by_variant
            )
            level, number, gain = noticeable_gains(inner, rhs, top, least)
            profile, known = gain + LOG_DENSITY, alike.known[number]
            profile[known] = -np.inf
            profile[known, UNIT_INDEX] = gain[known, UNIT_INDEX]
            size = profile.argmax(axis=1)
            some = gain[np.arange(len(size)), size] >= least[number]
            level, number = level[some], number[some]
            profile, size = profile[some], size[some]
            evidence = np.logaddexp.reduce(profile, axis=1)
            evidence += log_prior[at[number]]
            for i, shares in log_prior_by_variant.items():
                own = at[number] == i
                evidence[own] += shares[alike.variant[number[own]]] - log_prior[i]
            near = evidence > log_prior[at].min() - thresholds.OFFERED_LOG_DISTANCE
            kept = (part[near].tolist() for part in (level, number, size, evidence))
            for i, m, v, added in zip(*kept, strict=True):
                cause = self.sets.dictionary.causes[at[m]]
                if cause not in best[i] or added > best[i][cause][0]:
                    best[i][cause] = added, int(alike.variant[m]), v
        return best
