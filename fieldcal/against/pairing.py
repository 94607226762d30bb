"""The causes that two sessions are both asked for.

Those of the best set of either. Where one has a cause and the other an alias of it, the
alias gives way: the same physics under two names would be found in each alone. Of an
effect of which they show different parameters, both are asked for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldcal.against.side import Side
from fieldcal.against.widened import Widened, widened
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sizing import Member


class Pairing:
    """Two sessions with the same causes in both.

    Attributes
    ----------
    real, sim : the sides
    keys : of the causes, in order
    asked : both sessions with all of them
    instead : name of a cause by that of the alias which gave way to it

    """

    def __init__(self, real: Side, sim: Side) -> None:
        self.real, self.sim = real, sim
        self.later = sim.start - real.start
        self.instead: dict[str, str] = {}
        ours = _members(real.explanation)
        theirs = _members(sim.explanation)
        ours, lent = self._renamed(ours, theirs, real.explanation)
        theirs, borrowed = self._renamed(theirs, [*ours, *lent], sim.explanation)
        ours, theirs, whole = _as_wide(ours, theirs, real.explanation, sim.explanation)
        self.ours, self.theirs = ours, theirs
        for_us = _lacking(ours, [*lent, *theirs, *borrowed, *whole])
        for_them = _lacking(theirs, [*borrowed, *ours, *lent, *whole])
        self.asked = (
            widened(real.explanation, ours, for_us, -self.later),
            widened(sim.explanation, theirs, for_them, self.later),
        )
        sets = (one.set.members for one in self.asked)
        self.keys = list(dict.fromkeys(c.key for s in sets for c, _ in s))

    def _renamed(
        self, own: list[Member], other: Sequence[Member], explanation: Explanation
    ) -> tuple[list[Member], list[Member]]:
        """Own causes without those in whose place one of the other's may stand.

        Back come what is left, and what takes the place.
        """
        names = {c.name for c, _ in own}
        kept, taken = list(own), list[Member]()
        for name in list(names):
            stands = explanation.posterior.instead.get(name, {})
            for alias in stands:
                theirs = [m for m in other if m[0].name == alias]
                if alias in names or not theirs or name in {c.name for c, _ in other}:
                    continue
                kept = [m for m in kept if m[0].name != name]
                taken += theirs
                self.instead[alias] = name
                break
        return kept, taken

    def with_shape_of(self, key: str) -> list[tuple[Widened, Widened]]:
        """Both sessions with one cause at the shape that it has in either, in turn.

        Empty where the shape is none, or only one session has the cause by itself.
        """
        mine, yours = (
            next((m for m in some if m[0].key == key), None)
            for some in (self.ours, self.theirs)
        )
        if mine is None or yours is None or not mine[1].shape or mine[1].effect is None:
            return []
        real, sim = self.asked
        others = [m for m in self.theirs if m is not yours]
        at_ours = widened(self.sim.explanation, others, [mine], self.later)
        ours = [m for m in self.ours if m is not mine]
        at_theirs = widened(self.real.explanation, ours, [yours], -self.later)
        return [(real, at_ours), (at_theirs, sim)]


def _members(explanation: Explanation) -> list[Member]:
    return list(explanation.best.set.members)


def _lacking(own: Sequence[Member], others: Sequence[Member]) -> list[Member]:
    """Those of others that are not among one's own, each once."""
    keys = {c.key for c, _ in own}
    return list({c.key: (c, g) for c, g in others if c.key not in keys}.values())


def _as_wide(
    ours: list[Member], theirs: list[Member], real: Explanation, sim: Explanation
) -> tuple[list[Member], list[Member], list[Member]]:
    """Causes of which both have other parameters, with all: what is left, and these."""
    by_key = {c.key: g for c, g in theirs}
    whole = [
        (c, _all_parameters(c, g))
        for c, g in ours
        if c.key in by_key and by_key[c.key].params != g.params
    ]
    keys = {c.key for c, _ in whole}
    left = ([m for m in some if m[0].key not in keys] for some in (ours, theirs))
    return *left, whole  # type: ignore[return-value]


def _all_parameters(cause: Cause, group: Group) -> Group:
    """The group with all parameters of its cause, its shape as it is."""
    widest = max(cause.variants, key=lambda v: len(v.params))
    return replace(widest, shape=group.shape, origin=group.origin)
