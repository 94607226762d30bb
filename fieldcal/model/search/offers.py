"""Offers: every cause that is not in a set, with the log evidence it would add.

A cause is offered at its best variant and size, beside the set's instability as it is
and smaller in one triad, since what it explains there is instability no longer; the
other triad's stays, which nothing has explained.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import CLOSURE, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.smooth import WAVES
from fieldcal.model.evidence.gram import Eliminated, Gram, Weighed, gains
from fieldcal.model.evidence.sets import Set, Sets, chances
from fieldcal.model.evidence.sizing import DENSITY, EVEN, Sizes
from fieldcal.model.search.offer import (
    Best,
    Less,
    Offer,
    OfferTable,
    likelier,
    offered,
)

LEVELS = (3, 6, 9, 40)
"""Steps in size by which instability may fall when something is explained."""

FLICKER = (1, 2)
"""The same of flicker, beside which a walk is small if it is as large as it was."""

FALLING = ((0, 1, 2), (3, 4, 5, 6))
"""Instabilities that fall together: of a triad, and of turns with the gyroscopes."""

RAISED = (EVEN + 1, EVEN + 5)
"""Sizes to which that of turns' closures may rise where accelerometers were unsteady:
what bends both is less then, and what turns are off by for themselves stays."""

Level = tuple[Less, Eliminated, float]
"""An instability, a set eliminated beside it, and the set's score then."""

Asked = tuple[tuple[tuple[str, int], ...], Sizes | None]
"""A set by its key, and the sizes of what is always there beside which it is asked what
it may be given, if only beside those."""

TRIAD = 3
"""Outputs that flicker is on."""

WIDE = 30
"""Columns of a group from which its eigenvalues cost more than to look them up."""

LEAST = 0.5
"""Gain of ln L below which an offer is none, unless it is likelier than not anyway."""

NEAR = 12.0
"""How far an offer may be behind to be followed, ln: what is further no pair makes up
for."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What rows at one instability say of every column, whatever the set.

    Attributes
    ----------
    rows : so weighed
    pull : (k,) of all columns
    blocks : Phi^T R^-1 Phi of the blocks of each width

    """

    rows: Weighed
    pull: Array
    blocks: list[Array]


class Offers(Sets):
    """What sets may be given."""

    def __init__(self, dictionary: Dictionary, gram: Gram) -> None:
        super().__init__(dictionary, gram)
        self._tables: dict[Asked, list[OfferTable]] = {}
        self._at: dict[Less, Seen] = {}
        self._known: dict[int, Array] = {}

    def offers(self, there: Set, beside: Sizes | None = None) -> list[Offer]:
        """Every cause that a set has not, at its best variant, the best one first.

        What takes the place of a cause that was left out stands `beside` what this one
        stood beside, an instability and a flicker; other causes may need any.
        """
        best: dict[str, Offer] = {}
        for table in self.tables(there, beside):
            for each in table.offers:
                offer, name = self._in_full(there, each, table), each.member[0].key
                if name not in best or offer.score > best[name].score:
                    best[name] = offer
        return sorted(best.values(), key=lambda o: -o.score)

    def _in_full(self, there: Set, offer: Offer, table: OfferTable) -> Offer:
        """An offer by all its columns, where those it is offered by are not enough.

        A walk and flicker far above the noise have more waves than another course.
        """
        group = offer.member[1]
        outputs = TRIAD if group.random else len(group.params)
        if not outputs or len(group.columns) <= WAVES * outputs:
            return offer
        profile = DENSITY + gain_of(table.state, group)
        chance = self.chance([*there.members, offer.member])
        worth = float(np.logaddexp.reduce(profile)) + chance
        score = table.score + worth - self.chance(there.members)
        return replace(offer, score=score, size=int(np.argmax(profile)))

    def tables(self, there: Set, beside: Sizes | None = None) -> list[OfferTable]:
        """What a set may be given, beside each of some instabilities."""
        key = self.key(there.members)
        beside = beside and replace(beside, members=())
        asked = key, None if (key, None) in self._tables else beside
        if asked not in self._tables:
            levels = list(self._levels(there, beside))
            found = self._found(levels, *self._chances(there))
            self._tables[asked] = [
                OfferTable(less, state, score, offered(there, score, less, best))
                for (less, state, score), best in zip(levels, found, strict=True)
            ]
        return self._tables[asked]

    def _found(
        self, levels: Sequence[Level], share: Array, apart: dict[int, Array]
    ) -> list[Best]:
        """Every cause's best variant beside each level of a set."""
        found: list[Best] = [{} for _ in levels]
        screened = self._screen(levels)
        for alike, gain in zip(self.dictionary.by_width, screened, strict=True):
            at = alike.cause
            profile = gain + DENSITY
            size = profile.argmax(axis=2)
            taken = np.take_along_axis(gain, size[:, :, None], 2)[:, :, 0]
            level, number = np.nonzero(taken >= LEAST - likelier(alike, apart))
            evidence = np.logaddexp.reduce(profile[level, number], axis=1)
            evidence += share[at[number]]
            for i, shares in apart.items():
                some = at[number] == i
                evidence[some] += shares[alike.variant[number[some]]] - share[i]
            near = evidence > share[at].min() - NEAR
            each = (level[near], number[near], evidence[near])
            for i, m, worth in zip(*(e.tolist() for e in each), strict=True):
                cause = self.dictionary.causes[at[m]]
                if cause not in found[i] or worth > found[i][cause][0]:
                    found[i][cause] = worth, int(alike.variant[m]), int(size[i, m])
        return found

    def _chances(self, there: Set) -> tuple[Array, dict[int, Array]]:
        """Of every cause beside a set, ln; of those whose variants differ, of each."""
        names = {c.name for c, _ in there.members}
        usual = any(c.usual for c, _ in there.members)
        out, apart = self.dictionary.chances.copy(), dict[int, Array]()
        for i, cause in enumerate(self.dictionary.causes):
            if cause.name in names or cause.expected or (usual and cause.usual):
                shares = chances(cause, there.members)
                out[i] = shares.min()
                if shares.ndim:
                    apart[i] = shares
        return out, apart

    def _levels(self, there: Set, beside: Sizes | None) -> Iterator[Level]:
        """The set with its instability as it is and another, and its score then."""
        sizes = there.sizes
        base = there.score - there.state.score
        base -= self.alike(sizes.instability)
        columns, wide = there.state.columns, there.state.sizes
        ways = [(wide, 0.0), self.opened(there)]
        own = None if beside is None else beside.instability
        for less in self._less(sizes.instability, own):
            fallen = less != sizes.instability
            rows = self._seen(less).rows
            for before, cost in ways if fallen and ways[1][1] else ways[:1]:
                state = Eliminated.of(rows, columns, before)
                yield less, state, base + cost + state.score + self.alike(less)
        if beside is not None:
            yield from self._as_beside(there, base, beside)
            return
        rows = self._seen(sizes.instability).rows
        # what a device has anyway, with next to no change from nominal: what one cause
        # does to all axes, or in time, looks like it
        for group, some, size in self._always(there):
            if group.fixed is None and (group.in_step or not group.in_state):
                # flicker is what few windows have instead of instability
                down = [max(size - d, 0) for d in FLICKER if group.random]
                for lower in dict.fromkeys([*down, 0]):
                    small = wide.copy()
                    small[some] = group.sizes(float(priors.SIZES[lower]))
                    state = Eliminated.of(rows, columns, small)
                    lost = DENSITY[lower] - DENSITY[size]
                    score = there.score - there.state.score + state.score
                    yield sizes.instability, state, score + lost

    def _as_beside(self, there: Set, base: float, beside: Sizes) -> Iterator[Level]:
        """The set with a flicker as large as beside another one, if it has any."""
        wide, less, changed = there.state.sizes.copy(), beside.instability, False
        pairs = zip(self._always(there), beside.calibration, strict=True)
        for (group, some, size), other in pairs:
            if group.random and group.fixed is None and other != size:
                wide[some] = group.sizes(float(priors.SIZES[other]))
                base += float(DENSITY[other] - DENSITY[size])
                changed = True
        if changed:
            state = Eliminated.of(self._seen(less).rows, there.state.columns, wide)
            yield less, state, base + state.score + self.alike(less)

    def _less(self, instability: Less, beside: Less | None) -> list[Less]:
        """Instabilities as they are, and one other or some that are smaller."""
        if beside is not None:
            return list(dict.fromkeys([instability, beside]))
        found = [instability]
        for some in FALLING if self.unstable.any() else ():
            for down in LEVELS:
                found.append(fallen(instability, some, down))
        acc = FALLING[0]
        if self.unstable[CLOSURE] and max(instability[c] for c in acc) > EVEN:
            steady = fallen(instability, acc, LEVELS[-1])
            found += [steady[:CLOSURE] + (max(steady[CLOSURE], up),) for up in RAISED]
        return list(dict.fromkeys(found))

    def opened(self, there: Set) -> tuple[Array, float]:
        """Sizes with no calibration below what is typical, and what that costs, ln.

        Held against an instability that makes up for everything, a calibration seems to
        stay where it was.
        """
        wide, cost = there.state.sizes.copy(), 0.0
        for group, some, size in self._always(there):
            if group.fixed is None and size < EVEN:
                wide[some] = group.sizes(float(priors.SIZES[EVEN]))
                cost += float(DENSITY[EVEN] - DENSITY[size])
        return wide, cost

    def shown_by(self, there: Set) -> Callable[[Group], bool]:
        """Whether rows show a group beside a set, whatever the calibration is.

        Of two positions everything looks like bias and scale factor, and what these
        usually are would tell what is there.
        """
        wide = there.state.sizes.copy()
        for group, some, _ in self._always(there):
            if group.in_state and group.fixed is None:
                wide[some] = group.sizes(priors.FREE)
        free = Eliminated.of(there.state.rows, there.state.columns, wide)
        return lambda group: bool(gain_of(free, group).max() >= LEAST)

    def _always(self, there: Set) -> Iterator[tuple[Group, slice, int]]:
        """What is in every set, its place in one, and the index of its size there."""
        first = 0
        groups, sizes = self.dictionary.always, there.sizes.calibration
        for group, size in zip(groups, sizes, strict=True):
            yield group, slice(first, first := first + len(group.columns)), size

    def _seen(self, less: Less) -> Seen:
        """What the rows say of every column at one instability."""
        if less not in self._at:
            rows = self.weighed(less)
            blocks = rows.diagonals(
                [alike.blocks for alike in self.dictionary.by_width]
            )
            self._at[less] = Seen(rows, rows.pull(None), blocks)
        return self._at[less]

    def _screen(self, levels: Sequence[Level]) -> Iterator[Array]:
        """Gains over sizes of every variant beside each level, (l, m, sizes) by width.

        All levels at once: their number would otherwise cost more than their sums.
        """
        seen = [self._seen(less) for less, _, _ in levels]
        half, rest = [], []
        for there, (_, state, _) in zip(seen, levels, strict=True):
            shared = there.rows.matrix(state.columns, None)
            half.append(state.half @ shared)
            rest.append(there.pull - shared.T @ state.estimate)
        halves, rests = np.stack(half), np.stack(rest)
        for w, alike in enumerate(self.dictionary.by_width):
            own = np.stack([there.blocks[w] for there in seen])
            part = np.moveaxis(halves[:, :, alike.blocks], 1, 2)  # (l, b, a, k)
            typical, block = alike.typical, alike.block
            inner = (own - np.swapaxes(part, 2, 3) @ part)[:, block]
            inner *= typical[:, :, None] * typical[:, None, :]
            top = (np.diagonal(own, 0, 2, 3)[:, block] * typical**2).max(axis=-1)
            yield self._gains(inner, rests[:, alike.blocks[block]] * typical, top)

    def _gains(self, inner: Array, pull: Array, own: Array) -> Array:
        """Gains of groups; of wide ones only where no other instability gave the same.

        What no turn and no orientation connects with a triad does not see its
        instability.
        """
        if inner.shape[-1] < WIDE:
            return gains(inner, pull, own)
        shape, k = pull.shape[:-1], pull.shape[-1]
        inner, pull, own = inner.reshape(-1, k, k), pull.reshape(-1, k), own.ravel()
        keys = [
            hash(m.tobytes() + q.tobytes()) for m, q in zip(inner, pull, strict=True)
        ]
        new = {key: i for i, key in enumerate(keys) if key not in self._known}
        some = list(new.values())
        found = gains(inner[some], pull[some], own[some])
        self._known.update(zip(new, found, strict=True))
        return np.array([self._known[key] for key in keys]).reshape(*shape, -1)

    def taken(self, there: Set, *offers: Offer) -> Set:
        """The set with what was offered."""
        sizes = there.sizes
        less = tuple(
            max(some) if max(some) > now else min(some)
            for now, *some in zip(
                sizes.instability, *(o.less for o in offers), strict=True
            )
        )
        more = (o.size for o in offers)
        start = Sizes(sizes.calibration, less, (*sizes.members, *more))
        return self.evaluated((*there.members, *(o.member for o in offers)), start)


def gain_of(state: Eliminated, group: Group) -> Array:
    """What a group adds to a set, ln L, over its sizes."""
    at, typical = group.columns, group.typical
    own = np.diag(state.rows.matrix(at, at)) * typical**2
    return gains(*state.rest(at, typical), float(own.max()))


def fallen(instability: Less, some: Sequence[int], down: int) -> Less:
    """Instabilities of which some are smaller by so many steps."""
    return tuple(
        max(size - down, 0) if i in some else size for i, size in enumerate(instability)
    )
