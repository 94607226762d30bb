"""Sets of causes with their evidence.

A set's evidence is that of its groups at their likeliest sizes, times what every size
besides leaves of it,

    ln Z = F(v*) + sum_k ln sum_j exp(F(v_k = v_j) - F(v*)),    F = (2) + ln p(v)

and its weight is that times the chance of every cause in it. What is always there (an
instability, say) has a size as well, and is estimated beside every set anew: held
against the size of all that was unexplained before, no cause would explain anything.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.gram import Eliminated, Gram, Weighed
from fieldcal.model.evidence.sizing import Member, Sizes, Sizing, alike


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


def chances(cause: Cause, there: Iterable[Member]) -> Array:
    """Of a cause beside others, ln: of each variant, or of all alike ().

    What has an instant happens to both triads at once, or it is another event; most
    likely where the device may have been off. A device that nobody calibrated has all
    that is usual.
    """
    share = np.array(np.log(cause.chance / len(cause.variants)))
    if cause.expected:
        share = _shared(cause, share, cause.expected, priors.RESTARTED)
    if cause.kind != "effect":
        return share
    there = list(there)
    same = [m for m in there if m[0].name == cause.name]
    at_once = {g for _, other in same for g in cause.at_once(other)}
    if at_once:
        off = any(g in other.expected for other, g in same)
        both = cause.expected & at_once if off else frozenset[Group]()
        odds = 1 / priors.BOTH_RESTART if both else priors.AGAIN
        share = _shared(cause, share, at_once - both, odds)
        return _shared(cause, share, both, priors.BOTH_RESTART)
    if same or (cause.usual and any(other.usual for other, _ in there)):
        share = np.array(np.log(priors.AGAIN / len(cause.variants)))
    return share


def _shared(cause: Cause, share: Array, some: AbstractSet[Group], odds: float) -> Array:
    """What each variant has, ln, if some share other odds among them."""
    among = [g in some for g in cause.variants]
    return np.where(among, np.log(odds / max(len(some), 1)), share)


class Sets:
    """The sets that were looked at, over one Gram matrix."""

    def __init__(self, dictionary: Dictionary, gram: Gram) -> None:
        self.dictionary, self.gram = dictionary, gram
        there = np.unique(gram.kind[gram.info > 0])
        self.unstable = dictionary.unstable * np.isin(np.arange(7), there)
        self.visited: dict[tuple[tuple[str, int], ...], Set] = {}
        self._weighed: dict[tuple[int, ...], Weighed] = {}

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
        total, before = 0.0, list[Member]()
        for cause, group in members:
            shares = chances(cause, before)
            own = shares[cause.variants.index(group)] if shares.ndim else shares
            total += float(own)
            before.append((cause, group))
        return total

    def weighed(self, instability: tuple[int, ...]) -> Weighed:
        """Rows at some instabilities."""
        if instability not in self._weighed:
            tau = priors.SIZES[list(instability)] * self.unstable
            self._weighed[instability] = self.gram.weighed(tau)
        return self._weighed[instability]

    def alike(self, instability: Sequence[int] | Array) -> Any:
        """How likely instabilities (..., 7) are, ln: a triad's axes are much alike."""
        return alike(instability, self.unstable)

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
