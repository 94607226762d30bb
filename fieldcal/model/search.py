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
from fieldcal.model.causes import Cause, Dictionary, Group
from fieldcal.model.evidence import Eliminated, Gram, Weighed, gains
from fieldcal.model.pairs import pairs
from fieldcal.samples import Array

DENSITY = np.log(priors.density())
UNSTEADY = np.log(priors.density(priors.STEEP))
"""The same of instabilities."""

EVEN = int(np.argmin(np.abs(np.log(priors.SIZES))))
"""Index of v = 1."""

STEP = float(np.log(priors.SIZES[1] / priors.SIZES[0]))
"""From one size to the next, ln."""

ROUNDS = 5
"""Times that every size is sought beside the others."""

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

TRIADS = ((0, 1, 2), (3, 4, 5), (6,))
"""Kinds of instability that are alike: those of a triad's axes; the turns' closures."""

Member = tuple[Cause, Group]


@dataclass(frozen=True, slots=True)
class Sizes:
    """Indices in `priors.SIZES`.

    `calibration` of the always-there groups, `instability` of the channels and the
    turns, and `members` of the causes, in their order.
    """

    calibration: tuple[int, ...]
    instability: tuple[int, ...]
    members: tuple[int, ...] = ()


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
    state, score : of the set
    offers : the best first

    """

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
            self.visited[key] = _Sizing(self, members, start).run()
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
        sizes = np.asarray(instability, dtype=float)
        total = np.zeros(sizes.shape[:-1])
        for triad in TRIADS:
            if on := [c for c in triad if self.unstable[c] > 0]:
                some = sizes[..., on]
                middle = some.mean(axis=-1)
                total = total + np.interp(middle, np.arange(len(UNSTEADY)), UNSTEADY)
                apart = (some - middle[..., None]) * (STEP / priors.UNLIKE)
                total -= 0.5 * (apart**2).sum(axis=-1)
        return total if total.ndim else float(total)

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
                Table(state, score, self._at_level(there, state, score, down))
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
        open_, freed = self._opened(there)
        for down in LEVELS if self.unstable.any() else LEVELS[:1]:
            less = tuple(max(i - down, 0) for i in sizes.instability)
            before, cost = (open_, freed) if down else (wide, 0.0)
            state = Eliminated.of(self.weighed(less), columns, before)
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

    def _opened(self, there: Set) -> tuple[Array, float]:
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
            best = self._paired(there)
        for i in range(len(best.members)):
            less = self.without(best, i)
            best = max([best, less, self._followed(less, best.score)], key=_score)
        return best

    def _followed(self, there: Set, level: float) -> Set:
        """The best set with one more; the set itself if none comes near a level."""
        offers = self.offers(there)
        found = [there]
        for offer in offers[:FOLLOWED]:
            if offer.score > level - SLACK and offer.score > offers[0].score - NEAR:
                found.append(self.taken(there, offer))
        return max(found, key=_score)

    def _paired(self, there: Set) -> Set:
        """The best set with two more, of which neither is worth it alone."""
        tried: dict[tuple[str, str], tuple[float, Offer, Offer]] = {}
        for table in self.tables(there)[1 : len(LEVELS)]:
            known = [o for o in table.offers if o.member[0].kind != "unknown"]
            some = known[:PROMISING]
            groups, sizes = [o.member[1] for o in some], [o.size for o in some]
            for gain, (i, j), (u, v) in pairs(table.state, groups, sizes):
                one, two = replace(some[i], size=u), replace(some[j], size=v)
                key = (one.member[0].key, two.member[0].key)
                total = table.score + gain + self._more(there, one, two)
                if key not in tried or total > tried[key][0]:
                    tried[key] = (total, one, two)
        found = [there]
        for score, one, two in sorted(tried.values(), key=lambda t: -t[0])[:FOLLOWED]:
            if score > there.score - 2 * SLACK:
                found.append(self.taken(there, one, two))
        return max(found, key=_score)

    def _more(self, there: Set, one: Offer, two: Offer) -> float:
        """Chance of two more causes beside those of a set, ln."""
        both = [*there.members, one.member, two.member]
        return self.chance(both) - self.chance(there.members)

    def taken(self, there: Set, *offers: Offer) -> Set:
        """The set with what was offered."""
        sizes, down = there.sizes, max(o.level for o in offers)
        less = tuple(max(i - down, 0) for i in sizes.instability)
        more = (o.size for o in offers)
        open_ = tuple(max(i, EVEN) for i in sizes.calibration)
        calibration = open_ if down else sizes.calibration
        start = Sizes(calibration, less, (*sizes.members, *more))
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


def _score(one: Set) -> float:
    return one.score


class _Sizing:
    """The likeliest sizes of one set, each sought beside the others."""

    def __init__(
        self, search: Search, members: tuple[Member, ...], start: Sizes | None
    ) -> None:
        self.search, self.members = search, members
        self.always = search.dictionary.always
        self.groups: list[Group] = [*self.always, *(g for _, g in members)]
        begin = start or Sizes(
            (EVEN,) * len(self.always), (EVEN,) * 7, (EVEN,) * len(members)
        )
        self.sizes = [*begin.calibration, *begin.members]
        self.instability = list(begin.instability)
        self.unstable = search.unstable
        self.columns = [g.columns for g in self.groups]
        self.gram = search.gram.only(np.concatenate(self.columns))
        self.rows = self._weighed(self.instability)

    def run(self) -> Set:
        """Seek sizes until they stay, and sum up."""
        free = [i for i, g in enumerate(self.groups) if g.fixed is None]
        channels = np.flatnonzero(self.unstable > 0).tolist()
        profiles: list[Array] = []
        for _ in range(ROUNDS):
            before = (*self.sizes, *self.instability)
            profiles = [self._member(i) for i in free]
            for triad in TRIADS:
                if some := [c for c in triad if c in channels]:
                    profiles += self._triad(some)
            if (*self.sizes, *self.instability) == before:
                break
        self.rows = self.search.weighed(self.instability)
        state = self._eliminated()
        score = state.score
        score += sum(DENSITY[self.sizes[i]] for i in free)
        score += self.search.alike(self.instability)
        for profile in profiles:
            score += float(np.logaddexp.reduce(profile - profile.max()))
        score += self.search.chance(self.members)
        k = len(self.always)
        sizes = Sizes(
            tuple(self.sizes[:k]), tuple(self.instability), tuple(self.sizes[k:])
        )
        return Set(self.members, sizes, score, state)

    def _weighed(self, instability: Sequence[int]) -> Weighed:
        return self.gram.weighed(priors.SIZES[list(instability)] * self.unstable)

    def _eliminated(self, but: int = -1) -> Eliminated:
        """Columns of all groups but one, eliminated."""
        kept = [i for i in range(len(self.groups)) if i != but]
        none = np.empty(0, dtype=np.intp)
        columns = np.concatenate([none, *(self.columns[i] for i in kept)])
        wide = np.concatenate([np.empty(0), *(self._wide(i) for i in kept)])
        return Eliminated.of(self.rows, columns, wide)

    def _wide(self, i: int) -> Array:
        group = self.groups[i]
        v = float(priors.SIZES[self.sizes[i]]) if group.fixed is None else group.fixed
        return group.sizes(v)

    def _member(self, i: int) -> Array:
        """F over the sizes of one group, and its size at the top."""
        one, rest = self.groups[i], self._eliminated(i)
        inner, pull = rest.rest(one.columns, one.typical)
        own = np.diag(inner).max() + 1e-300
        profile: Array = rest.score + gains(inner, pull, own * 1e-3) + DENSITY
        self.sizes[i] = int(np.argmax(profile))
        return profile

    def _triad(self, channels: Sequence[int]) -> list[Array]:
        """F over the instabilities of each of some channels that are much alike.

        They are set together: one by one none could leave the others behind.
        """
        alone = {c: self._channel(c) for c in channels}
        index = np.arange(len(DENSITY))
        apart = np.subtract.outer(index, index) * STEP / priors.UNLIKE
        best = [gain - 0.5 * apart**2 for gain in alone.values()]  # by middle, size
        total = sum(b.max(axis=1) for b in best) + UNSTEADY
        middle = int(np.argmax(total))
        for c, one in zip(channels, best, strict=True):
            self.instability[c] = int(np.argmax(one[middle]))
        self.rows = self._weighed(self.instability)
        return [self._beside(c, alone[c]) for c in channels]

    def _beside(self, c: int, gain: Array) -> Array:
        """F over the sizes of a channel beside those of the others, of its gain."""
        every = np.tile(self.instability, (len(DENSITY), 1))
        every[:, c] = np.arange(len(DENSITY))
        out: Array = gain + self.search.alike(every)
        return out

    def _channel(self, c: int) -> Array:
        """Gain over the instabilities of one channel, the others as they are."""
        none = self.unstable * priors.SIZES[self.instability]
        none[c] = 0.0
        self.rows = self.gram.weighed(none)
        inner, pull = self._eliminated().of_means(c, float(self.unstable[c]))
        self.rows = self._weighed(self.instability)
        return gains(inner, pull, np.diag(inner).max())
