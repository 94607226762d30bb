"""Sets of causes, their evidence, and the search for those that matter.

A set's evidence is that of its groups at their likeliest sizes, times what every size
besides leaves of it,

    ln Z = F(v*) + sum_k ln sum_j exp(F(v_k = v_j) - F(v*)),    F = (2) + ln p(v)

and its weight is that times the chance of every cause in it. What is always there (an
instability, say) has a size as well, and is estimated beside every set anew: held
against the size of all that was unexplained before, no cause would explain anything.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.model import priors
from fieldcal.model.dictionary import Dictionary
from fieldcal.model.evidence import Eliminated, Gram, Weighed, gains
from fieldcal.model.pairs import pairs
from fieldcal.model.sizing import DENSITY, EVEN, Member, Sizes, Sizing, alike
from fieldcal.samples import Array

SETTLED = 0.02
"""Rise of ln Z that is none."""

MOST = 10
"""Steps of one search."""

FOLLOWED = 4
"""Offers that are evaluated in full, at each step."""

NEAR = 12.0
"""How far an offer may be behind the best one to be followed, ln."""

PROMISING = 16
"""Causes of which pairs are tried."""

LEVELS = (0, 3, 6, 9, 40)
"""Steps in size by which instability may fall when something is explained."""


@dataclass(frozen=True, slots=True, eq=False)
class Set:
    """Causes with their groups, and the sizes of all groups.

    Attributes
    ----------
    members : causes, each with the variant of it
    sizes : of everything
    score : ln of evidence times chance
    state : of all its columns, eliminated

    """

    members: tuple[Member, ...]
    sizes: Sizes
    score: float
    state: Eliminated

    @property
    def keys(self) -> frozenset[str]:
        """Of the causes in it."""
        return frozenset(c.key for c, _ in self.members)


@dataclass(frozen=True, slots=True, eq=False)
class Offer:
    """A member that a set may be given.

    Attributes
    ----------
    member : cause and variant
    score : of the set with it, foretold
    size : index of its likeliest size
    level : by how much the instability is less beside it

    """

    member: Member
    score: float
    size: int
    level: int


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """What may be added to a set beside one instability.

    Attributes
    ----------
    down : by how much its instability is less
    state, score : of the set
    offers : the best first

    """

    down: int
    state: Eliminated
    score: float
    offers: list[Offer]


class Search:
    """The search over one Gram matrix."""

    def __init__(self, dictionary: Dictionary, gram: Gram) -> None:
        self.dictionary, self.gram = dictionary, gram
        there = np.unique(gram.kind[gram.info > 0])
        self.unstable = dictionary.unstable * np.isin(np.arange(7), there)
        self.visited: dict[tuple[tuple[str, int], ...], Set] = {}
        self._tables: dict[tuple[tuple[str, int], ...], list[Table]] = {}

    # -- one set

    @staticmethod
    def key(members: Iterable[Member]) -> tuple[tuple[str, int], ...]:
        """What a set is known by."""
        return tuple(sorted((c.key, c.variants.index(g)) for c, g in members))

    def evaluated(self, members: tuple[Member, ...], start: Sizes | None = None) -> Set:
        """A set with its sizes at their likeliest, and its weight."""
        key = self.key(members)
        if key not in self.visited:
            sizing = Sizing(self.dictionary, self.gram, self.unstable, members, start)
            sizes, score, wide = sizing.run()
            rows = self.weighed(sizes.instability)
            state = Eliminated.of(rows, sizing.every, wide)
            score += self.chance(members)
            self.visited[key] = Set(members, sizes, score, state)
        return self.visited[key]

    def chance(self, members: Iterable[Member]) -> float:
        """Of the causes of a set, ln."""
        names: set[str] = set()
        total = 0.0
        for cause, _ in members:
            again = cause.kind == "effect" and cause.name in names
            total += np.log(priors.AGAIN if again else cause.chance)
            total -= np.log(len(cause.variants))
            names.add(cause.name)
        return float(total)

    def weighed(self, instability: Iterable[int]) -> Weighed:
        """Rows at some instabilities."""
        wide = np.array([priors.SIZES[i] for i in instability])
        return self.gram.weighed(wide * self.unstable)

    def alike(self, instability: Sequence[int] | Array) -> Any:
        """How likely instabilities (..., 7) are, ln: a triad's axes are much alike."""
        return alike(instability, self.unstable)

    # -- one more

    def offers(self, there: Set) -> list[Offer]:
        """Every cause that a set has not, at its best variant, the best one first."""
        best: dict[str, Offer] = {}
        for table in self.tables(there):
            for offer in table.offers:
                name = offer.member[0].key
                if name not in best or offer.score > best[name].score:
                    best[name] = offer
        return sorted(best.values(), key=lambda o: -o.score)

    def tables(self, there: Set) -> list[Table]:
        """What a set may be given, beside each of some instabilities."""
        key = self.key(there.members)
        if key not in self._tables:
            self._tables[key] = [
                Table(down, state, score, self._at_level(there, state, score, down))
                for down, state, score in self._levels(there)
            ]
        return self._tables[key]

    def _at_level(
        self, there: Set, state: Eliminated, score: float, down: int
    ) -> list[Offer]:
        """Every cause that a set has not, beside one instability, the best first."""
        d, chances = self.dictionary, self._chances(there)
        best: dict[int, tuple[float, int, int]] = {}
        for (_, _, at, variant), gain in zip(
            d.by_width, self._screen(state), strict=True
        ):
            profile = gain + DENSITY
            size = profile.argmax(axis=1)
            worth = np.logaddexp.reduce(profile, axis=1) + chances[at]
            worth[np.take_along_axis(gain, size[:, None], 1)[:, 0] < LEAST] = -np.inf
            for m in np.flatnonzero(worth > LOST + chances[at].min()).tolist():
                if int(at[m]) not in best or worth[m] > best[int(at[m])][0]:
                    best[int(at[m])] = float(worth[m]), int(variant[m]), int(size[m])
        offers = [
            Offer((c, c.variants[v]), score + worth, size, down)
            for c, (worth, v, size) in ((d.causes[i], b) for i, b in best.items())
            if c.key not in there.keys
        ]
        return sorted(offers, key=lambda o: -o.score)

    def _chances(self, there: Set) -> Array:
        """Of every cause beside a set, by its number, ln."""
        names = {c.name for c, _ in there.members if c.kind == "effect"}
        out = self.dictionary.chances.copy()
        for i, cause in enumerate(self.dictionary.causes):
            if cause.name in names and cause.kind == "effect":
                out[i] += np.log(priors.AGAIN / cause.chance)
        return out

    def _levels(self, there: Set) -> Iterator[tuple[int, Eliminated, float]]:
        """The set with its instability as it is and smaller, and its score then."""
        sizes = there.sizes
        base = there.score - there.state.score
        base -= self.alike(sizes.instability)
        columns, wide = there.state.columns, there.state.sizes
        ways = [(wide, 0.0), self.opened(there)]
        for down in LEVELS if self.unstable.any() else LEVELS[:1]:
            less = tuple(max(i - down, 0) for i in sizes.instability)
            rows = self.weighed(less)
            for before, cost in ways if down and ways[1][1] else ways[:1]:
                state = Eliminated.of(rows, columns, before)
                yield down, state, base + cost + state.score + self.alike(less)
        first, rows = 0, self.weighed(sizes.instability)
        for group, size in zip(
            self.dictionary.always, sizes.calibration, strict=True
        ):  # what a device has anyway, with next to no change from nominal
            some = slice(first, first := first + len(group.columns))
            if group.in_step:
                small = wide.copy()
                small[some] = group.sizes(float(priors.SIZES[0]))
                state = Eliminated.of(rows, columns, small)
                lost = DENSITY[0] - DENSITY[size]
                yield 0, state, there.score - there.state.score + state.score + lost

    def opened(self, there: Set) -> tuple[Array, float]:
        """Sizes with no calibration below what is typical, and what that costs, ln.

        Held against an instability that makes up for everything, a calibration seems to
        stay where it was.
        """
        wide, first, cost = there.state.sizes.copy(), 0, 0.0
        pairs = zip(self.dictionary.always, there.sizes.calibration, strict=True)
        for group, size in pairs:
            some = slice(first, first := first + len(group.columns))
            if group.fixed is None and size < EVEN:
                wide[some] = group.sizes(float(priors.SIZES[EVEN]))
                cost += float(DENSITY[EVEN] - DENSITY[size])
        return wide, cost

    def _screen(self, state: Eliminated) -> Iterator[Array]:
        """Gains over sizes of every variant of every cause, (m, sizes) by width."""
        rows = state.rows
        shared, own = (
            rows.matrix(state.columns, None),
            rows.diagonals([at for at, *_ in self.dictionary.by_width]),
        )
        half = np.linalg.cholesky(state.inverse).T @ shared
        pull = rows.pull(None) - shared.T @ state.estimate
        for (at, typical, _, _), block in zip(
            self.dictionary.by_width, own, strict=True
        ):
            part = np.moveaxis(half[:, at], 0, 1)  # (m, a, k)
            inner = block - np.swapaxes(part, 1, 2) @ part
            inner *= typical[:, :, None] * typical[:, None, :]
            top = (np.diagonal(block, 0, 1, 2) * typical**2).max(axis=-1)
            yield gains(inner, pull[at] * typical, top)

    # -- the search

    def run(self, start: tuple[Member, ...] = ()) -> Set:
        """The set of the highest weight that is found."""
        best = self.evaluated(start)
        for _ in range(MOST):
            better = self._step(best)
            if better.score <= best.score + SETTLED:
                break
            best = better
        return best

    def _step(self, there: Set) -> Set:
        """The best of the set with one or two more, with one less, or with one else."""
        best = self._followed(there, there.score)
        if best is there:
            best = self._paired(there, there.score)
        for i in range(len(best.members)):
            less = self.without(best, i)
            best = max([best, less, self._followed(less, best.score)], key=_score)
        return self._instead(best) if best is there else best

    def _instead(self, there: Set) -> Set:
        """The best set with two or three causes in the place of one without physics.

        A function of many columns does for what several effects make together, of which
        none alone is worth as much: that of the most columns, when nothing else helps.
        """
        width = [len(g.columns) * (c.kind == "unknown") for c, g in there.members]
        if max(width, default=0) <= 1:
            return there
        less = self.without(there, int(np.argmax(width)))
        two = self._paired(less, there.score)
        return max([there, two, self._followed(two, there.score)], key=_score)

    def _followed(self, there: Set, level: float) -> Set:
        """The best set with one more; the set itself if none comes near a level."""
        offers = self.offers(there)
        found = [there]
        for offer in offers[:FOLLOWED]:
            if offer.score > level - SLACK and offer.score > offers[0].score - NEAR:
                found.append(self.taken(there, offer))
        return max(found, key=_score)

    def _paired(self, there: Set, level: float) -> Set:
        """The best set with two more, of which neither is worth it alone.

        The set itself if none comes near a level.
        """
        tried: dict[tuple[str, str], tuple[float, Offer, Offer]] = {}
        for table in self.tables(there):
            if not table.down:
                continue
            for one, two, gain in _pairs(table):
                key = (one.member[0].key, two.member[0].key)
                total = table.score + gain + self._more(there, one, two)
                if key not in tried or total > tried[key][0]:
                    tried[key] = (total, one, two)
        near = sorted(tried.values(), key=lambda t: -t[0])[:FOLLOWED]
        near = [t for t in near if t[0] > level - 2 * SLACK]
        found = [self.taken(there, one, two) for _, one, two in near]
        return max(found, key=_score, default=there)

    def _more(self, there: Set, one: Offer, two: Offer) -> float:
        """Chance of two more causes beside those of a set, ln."""
        both = [*there.members, one.member, two.member]
        return self.chance(both) - self.chance(there.members)

    def taken(self, there: Set, *offers: Offer) -> Set:
        """The set with what was offered."""
        sizes, down = there.sizes, max(o.level for o in offers)
        less = tuple(max(i - down, 0) for i in sizes.instability)
        more = (o.size for o in offers)
        start = Sizes(sizes.calibration, less, (*sizes.members, *more))
        return self.evaluated((*there.members, *(o.member for o in offers)), start)

    def without(self, there: Set, i: int) -> Set:
        """The set without one of its members."""
        kept = tuple(m for j, m in enumerate(there.members) if j != i)
        return self.evaluated(kept, self.sizes_of(there, kept))

    @staticmethod
    def sizes_of(there: Set, kept: tuple[Member, ...]) -> Sizes:
        """Sizes to start from with some of a set's members."""
        pairs = zip(there.members, there.sizes.members, strict=True)
        sizes = tuple(s for m, s in pairs if m in kept)
        return Sizes(there.sizes.calibration, there.sizes.instability, sizes)


SLACK = 3.0
"""What the full evaluation of an offer may find beyond what was foretold, ln."""

LEAST = 0.5
"""Gain of ln L below which an offer is none."""

LOST = -12.0
"""Worth of an offer that no pair makes up for, ln."""


def _pairs(table: Table) -> Iterator[tuple[Offer, Offer, float]]:
    """Every two offers of a table with their gain.

    Each with all its parameters as well: beside the other it may need them.
    """
    known = [o for o in table.offers if o.member[0].kind != "unknown"][:PROMISING]
    wide = [_widened(o) for o in known]
    for some in (known, wide) if wide != known else (known,):
        groups, sizes = [o.member[1] for o in some], [o.size for o in some]
        for gain, (i, j), (u, v) in pairs(table.state, groups, sizes):
            if some is known or some[i] != known[i] or some[j] != known[j]:
                yield replace(some[i], size=u), replace(some[j], size=v), gain


def _widened(offer: Offer) -> Offer:
    """An offer with all the parameters that its cause has."""
    cause, group = offer.member
    whole = cause.variants[0]
    if group.shape or group.params == whole.params:
        return offer
    return replace(offer, member=(cause, whole))


def _score(one: Set) -> float:
    return one.score
