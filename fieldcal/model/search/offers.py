"""Offers: every cause that is not in a set, with the log evidence it would add.

A cause is offered at its best variant and size, at the set's instability and at smaller
ones of one triad, since a scatter that the cause explains is no longer instability. The
instability of the other triad is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.smooth import MAX_COSINES
from fieldcal.model.evidence.gram import Eliminated, Gram, WeightedGram, evidence_gains
from fieldcal.model.evidence.sets import Set, SetKey, Sets, variant_log_priors
from fieldcal.model.evidence.sizing import LOG_DENSITY, UNIT_INDEX, Sizes
from fieldcal.model.search.instabilities import InstabilityIndices, tried_instabilities
from fieldcal.model.search.offer import (
    BestVariants,
    Offer,
    OfferTable,
    extra_log_odds,
    ranked_offers,
)

FLICKER_STEPS_DOWN = (1, 2)
"""The same for flicker: at its full size it explains most of a random walk."""

SetAtInstability = tuple[InstabilityIndices, Eliminated, float]
"""An instability, and a set's state and score at it."""

OfferKey = tuple[SetKey, Sizes | None]
"""Key of a set, and the sizes to which its offers are restricted, if any."""

FLICKER_OUTPUTS = 3
"""Number of outputs of a group of flicker."""

MIN_CACHED_COLUMNS = 30
"""Number of columns of a group from which its gains are cached."""

MIN_LOG_GAIN = 0.5
"""Gain of ln L below which there is no offer, unless the cause is likely a priori: one
parameter gains that much from noise."""

MAX_LOG_DISTANCE = 12.0
"""Largest distance of an offer from the best to be evaluated, ln."""


@dataclass(frozen=True, slots=True)
class WeightedColumns:
    """Products of all columns at one instability, for any set.

    Attributes
    ----------
    rows : Gram matrix weighted with the instability
    rhs : (k,) of all columns
    blocks : Phi^T R^-1 Phi of the blocks of each width

    """

    rows: WeightedGram
    rhs: Array
    blocks: list[Array]


class Offers(Sets):
    """Calculates offers to sets."""

    def __init__(self, dictionary: Dictionary, gram: Gram) -> None:
        super().__init__(dictionary, gram)
        self._tables: dict[OfferKey, list[OfferTable]] = {}
        self._at: dict[InstabilityIndices, WeightedColumns] = {}
        self._wide_gains: dict[bytes, Array] = {}

    def offers(self, there: Set, beside: Sizes | None = None) -> list[Offer]:
        """Every cause that a set does not contain, at its best variant, the best first.

        Of causes that differ only in their position, the best one.

        With `beside`, the sizes of another set, only its instability and flicker are
        tried besides the set's own: a cause that replaces a removed one needs these.
        """
        best: dict[tuple[str, str], Offer] = {}
        for table in self.tables(there, beside):
            for each in table.offers:
                offer = self._evaluate_all_columns(there, each, table)
                name = each.member[0].name_and_part
                if name not in best or offer.score > best[name].score:
                    best[name] = offer
        return sorted(best.values(), key=lambda o: -o.score)

    def _evaluate_all_columns(
        self, there: Set, offer: Offer, table: OfferTable
    ) -> Offer:
        """An offer recalculated with all columns of its group, if it has many.

        Random walks and flicker far above the noise need more than the leading columns.
        """
        group = offer.member[1]
        outputs = FLICKER_OUTPUTS if group.random else len(group.params)
        if not outputs or len(group.columns) <= MAX_COSINES * outputs:
            return offer
        profile = LOG_DENSITY + table.state.gain_by_size(group.columns, group.typical)
        chance = self.set_log_prior([*there.members, offer.member])
        worth = float(np.logaddexp.reduce(profile)) + chance
        score = table.score + worth - self.set_log_prior(there.members)
        return replace(offer, score=score, size=int(np.argmax(profile)))

    def tables(self, there: Set, beside: Sizes | None = None) -> list[OfferTable]:
        """Offers to a set at each of some instabilities; cached."""
        key = self.key(there.members)
        beside = beside and replace(beside, members=())
        asked = key, None if (key, None) in self._tables else beside
        if asked not in self._tables:
            levels = list(self._at_instabilities(there, beside))
            found = self._best_variants(levels, *self._cause_log_priors(there))
            self._tables[asked] = [
                OfferTable(less, state, score, ranked_offers(there, score, less, best))
                for (less, state, score), best in zip(levels, found, strict=True)
            ]
        return self._tables[asked]

    def _best_variants(
        self,
        levels: Sequence[SetAtInstability],
        log_prior: Array,
        log_prior_by_variant: dict[int, Array],
    ) -> list[BestVariants]:
        """Best variant of every cause at each level of a set."""
        found: list[BestVariants] = [{} for _ in levels]
        screened = self._screen(levels)
        for alike, gain in zip(self.dictionary.groups_by_width, screened, strict=True):
            at = alike.cause
            profile = gain + LOG_DENSITY
            size = profile.argmax(axis=2)
            taken = np.take_along_axis(gain, size[:, :, None], 2)[:, :, 0]
            level, number = np.nonzero(
                taken >= MIN_LOG_GAIN - extra_log_odds(alike, log_prior_by_variant)
            )
            evidence = np.logaddexp.reduce(profile[level, number], axis=1)
            evidence += log_prior[at[number]]
            for i, shares in log_prior_by_variant.items():
                some = at[number] == i
                evidence[some] += shares[alike.variant[number[some]]] - log_prior[i]
            near = evidence > log_prior[at].min() - MAX_LOG_DISTANCE
            each = (level[near], number[near], evidence[near])
            for i, m, worth in zip(*(e.tolist() for e in each), strict=True):
                cause = self.dictionary.causes[at[m]]
                if cause not in found[i] or worth > found[i][cause][0]:
                    found[i][cause] = worth, int(alike.variant[m]), int(size[i, m])
        return found

    def _cause_log_priors(self, there: Set) -> tuple[Array, dict[int, Array]]:
        """Log prior of every cause given a set; for each variant where they differ."""
        names = {c.name for c, _ in there.members}
        usual = any(c.usual for c, _ in there.members)
        out, log_prior_by_variant = (
            self.dictionary.cause_log_priors.copy(),
            dict[int, Array](),
        )
        for i, cause in enumerate(self.dictionary.causes):
            if cause.name in names or cause.expected or (usual and cause.usual):
                shares = variant_log_priors(cause, there.members)
                out[i] = shares.min()
                if shares.ndim:
                    log_prior_by_variant[i] = shares
        return out, log_prior_by_variant

    def _at_instabilities(
        self, there: Set, beside: Sizes | None
    ) -> Iterator[SetAtInstability]:
        """The set's state and score at its own instability and at other ones."""
        sizes = there.sizes
        base = there.score - there.state.score
        base -= self.instability_log_prior(sizes.instability)
        columns, prior_sigma = there.state.columns, there.state.prior_sigma
        ways = [(prior_sigma, 0.0), self.with_typical_calibration(there)]
        own = None if beside is None else beside.instability
        for less in tried_instabilities(
            self.typical_instability, sizes.instability, own
        ):
            fallen = less != sizes.instability
            rows = self._weighted_columns(less).rows
            for before, cost in ways if fallen and ways[1][1] else ways[:1]:
                state = Eliminated.of(rows, columns, before)
                yield (
                    less,
                    state,
                    base + cost + state.score + self.instability_log_prior(less),
                )
        if beside is not None:
            yield from self._with_flicker_of(there, base, beside)
            return
        rows = self._weighted_columns(sizes.instability).rows
        # permanent groups at smaller sizes: a cause that changes all axes, or that is a
        # course in time, may otherwise be absorbed by them
        for group, some, size in self._permanent_groups(there):
            if group.fixed_size is None and (
                group.changes_together or not group.in_state
            ):
                # flicker is what few windows have instead of instability
                down = [max(size - d, 0) for d in FLICKER_STEPS_DOWN if group.random]
                for lower in dict.fromkeys([*down, 0]):
                    small = prior_sigma.copy()
                    small[some] = group.prior_sigma(float(priors.SIZES[lower]))
                    state = Eliminated.of(rows, columns, small)
                    lost = LOG_DENSITY[lower] - LOG_DENSITY[size]
                    score = there.score - there.state.score + state.score
                    yield sizes.instability, state, score + lost

    def _with_flicker_of(
        self, there: Set, base: float, beside: Sizes
    ) -> Iterator[SetAtInstability]:
        """The set with the flicker sizes of another set, if it has flicker."""
        prior_sigma, less, changed = (
            there.state.prior_sigma.copy(),
            beside.instability,
            False,
        )
        pairs = zip(self._permanent_groups(there), beside.calibration, strict=True)
        for (group, some, size), other in pairs:
            if group.random and group.fixed_size is None and other != size:
                prior_sigma[some] = group.prior_sigma(float(priors.SIZES[other]))
                base += float(LOG_DENSITY[other] - LOG_DENSITY[size])
                changed = True
        if changed:
            state = Eliminated.of(
                self._weighted_columns(less).rows, there.state.columns, prior_sigma
            )
            yield less, state, base + state.score + self.instability_log_prior(less)

    def with_typical_calibration(self, there: Set) -> tuple[Array, float]:
        """Prior sizes with no calibration below its typical size, and their cost, ln.

        If a large instability absorbs all differences, the most probable sizes of the
        calibration are too small.
        """
        prior_sigma, cost = there.state.prior_sigma.copy(), 0.0
        for group, some, size in self._permanent_groups(there):
            if group.fixed_size is None and size < UNIT_INDEX:
                prior_sigma[some] = group.prior_sigma(float(priors.SIZES[UNIT_INDEX]))
                cost += float(LOG_DENSITY[UNIT_INDEX] - LOG_DENSITY[size])
        return prior_sigma, cost

    def shown_beside(self, there: Set) -> Callable[[Group], bool]:
        """Test whether rows show a group in addition to a set and a free calibration.

        In two positions every cause looks like bias and scale factor; only their prior
        would distinguish it.
        """
        prior_sigma = there.state.prior_sigma.copy()
        for group, some, _ in self._permanent_groups(there):
            if group.in_state and group.fixed_size is None:
                prior_sigma[some] = group.prior_sigma(priors.FREE_SIZE)
        free = Eliminated.of(there.state.rows, there.state.columns, prior_sigma)

        def is_shown(group: Group) -> bool:
            gains = free.gain_by_size(group.columns, group.typical)
            return bool(gains.max() >= MIN_LOG_GAIN)

        return is_shown

    def _permanent_groups(self, there: Set) -> Iterator[tuple[Group, slice, int]]:
        """Permanent groups, their places in the columns, and indices of their sizes."""
        first = 0
        groups, sizes = self.dictionary.always, there.sizes.calibration
        for group, size in zip(groups, sizes, strict=True):
            yield group, slice(first, first := first + len(group.columns)), size

    def _weighted_columns(self, less: InstabilityIndices) -> WeightedColumns:
        """Products of all columns at one instability; cached."""
        if less not in self._at:
            rows = self.gram_at(less)
            blocks = rows.diagonals(
                [alike.blocks for alike in self.dictionary.groups_by_width]
            )
            self._at[less] = WeightedColumns(rows, rows.rhs(None), blocks)
        return self._at[less]

    def _screen(self, levels: Sequence[SetAtInstability]) -> Iterator[Array]:
        """Gain at each size of every variant at each level, (l, m, sizes) by width.

        All levels are calculated together, which is faster than one by one.
        """
        seen = [self._weighted_columns(less) for less, _, _ in levels]
        half, rest = [], []
        for there, (_, state, _) in zip(seen, levels, strict=True):
            shared = there.rows.matrix(state.columns, None)
            half.append(state.half @ shared)
            rest.append(there.rhs - shared.T @ state.estimate)
        halves, rests = np.stack(half), np.stack(rest)
        for w, alike in enumerate(self.dictionary.groups_by_width):
            own = np.stack([there.blocks[w] for there in seen])
            part = np.moveaxis(halves[:, :, alike.blocks], 1, 2)  # (l, b, a, k)
            typical, block = alike.typical, alike.block
            inner = (own - np.swapaxes(part, 2, 3) @ part)[:, block]
            inner *= typical[:, :, None] * typical[:, None, :]
            top = (np.diagonal(own, 0, 2, 3)[:, block] * typical**2).max(axis=-1)
            yield self._gains(inner, rests[:, alike.blocks[block]] * typical, top)

    def _gains(self, inner: Array, rhs: Array, own: Array) -> Array:
        """Gains of groups; those of wide groups are cached by their matrices.

        A group that is not connected with a triad has the same gain at all of its
        instabilities.
        """
        if inner.shape[-1] < MIN_CACHED_COLUMNS:
            return evidence_gains(inner, rhs, own)
        shape, k = rhs.shape[:-1], rhs.shape[-1]
        inner, rhs, own = inner.reshape(-1, k, k), rhs.reshape(-1, k), own.ravel()
        keys = [_digest(*each) for each in zip(inner, rhs, own[:, None], strict=True)]
        new = {key: i for i, key in enumerate(keys) if key not in self._wide_gains}
        some = list(new.values())
        found = evidence_gains(inner[some], rhs[some], own[some])
        self._wide_gains.update(zip(new, found, strict=True))
        return np.array([self._wide_gains[key] for key in keys]).reshape(*shape, -1)

    def accept(self, there: Set, *offers: Offer) -> Set:
        """The set with the offered members."""
        sizes = there.sizes
        less = tuple(
            max(some) if max(some) > now else min(some)
            for now, *some in zip(
                sizes.instability, *(o.instability for o in offers), strict=True
            )
        )
        more = (o.size for o in offers)
        start = Sizes(sizes.calibration, less, (*sizes.members, *more))
        return self.evaluate((*there.members, *(o.member for o in offers)), start)


def _digest(*arrays: Array) -> bytes:
    """Key of some arrays, by their values."""
    return blake2b(b"".join(a.tobytes() for a in arrays), digest_size=16).digest()
