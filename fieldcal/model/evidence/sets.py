"""Sets of causes with their evidence.

The evidence of a set is that of its groups at their most probable sizes, times a factor
for the width of the posterior of each size,

    ln Z = F(v*) + sum_k ln sum_j exp(F(v_k = v_j) - F(v*)),    F = (2) + ln p(v)

and its weight is the evidence times the prior probability of each of its causes. What
is always present, such as an instability, has a size as well. That size is estimated
again for every set. If an instability kept the size that it needs without any cause, it
would explain everything that a cause could explain.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.gram import Gram, WeightedGram
from fieldcal.model.evidence.sizing import (
    Member,
    Sizes,
    Sizing,
    instability_log_prior,
    keys_of,
)

SetKey = tuple[tuple[str, int], ...]
"""Key of a set: the keys of its causes with the indices of their variants."""


@dataclass(frozen=True, slots=True, eq=False)
class Set:
    """A set of causes with their groups, and the sizes of all groups.

    Attributes
    ----------
    members : causes, each with its variant
    sizes : of all groups and instabilities
    score : ln of evidence times prior probability
    state : posterior of all its columns

    """

    members: tuple[Member, ...]
    sizes: Sizes
    score: float
    state: Eliminated

    @property
    def keys(self) -> frozenset[str]:
        """Keys of its causes."""
        return keys_of(self.members)

    @property
    def keys_in_state(self) -> frozenset[str]:
        """Keys of its causes that the base state contains."""
        return frozenset(c.key for c, g in self.members if g.in_state)

    @property
    def has_unknown_cause(self) -> bool:
        """Whether it contains a cause without physics."""
        return any(cause.kind == "unknown" for cause, _ in self.members)

    def sizes_of(self, kept: tuple[Member, ...]) -> Sizes:
        """Its sizes, with those of only some of its members."""
        pairs = zip(self.members, self.sizes.members, strict=True)
        sizes = tuple(size for member, size in pairs if member in kept)
        return Sizes(self.sizes.calibration, self.sizes.instability, sizes)


def is_function(member: Member) -> bool:
    """Whether a member is an unknown function of several columns.

    The offset of a single window does not count: it cannot replace effects.
    """
    cause, group = member
    return cause.kind == "unknown" and len(group.columns) > 1


def variant_log_priors(cause: Cause, others: Iterable[Member]) -> Array:
    """Log prior probability of a cause, given others in the set.

    An array with one value for each variant, or of shape () if all variants have the
    same. A cause that begins at an instant is likelier if another of the same event, as
    on the other triad, is in the set and begins at the same instant, above all when the
    device may have been switched off. If one usual cause is in the set, the device was
    probably never calibrated, and the other usual causes are likelier.
    """
    share = np.array(np.log(cause.chance / len(cause.variants)))
    if cause.expected:
        share = _with_other_odds(cause, share, cause.expected, priors.RESTART_CHANCE)
    if cause.kind != "effect":
        return share
    others = list(others)
    same = [m for m in others if m[0].event == cause.event]
    at_once = {g for _, other in same for g in cause.simultaneous_variants(other)}
    if at_once:
        off = any(g in other.expected for other, g in same if other.name == cause.name)
        both = cause.expected & at_once if off else frozenset[Group]()
        odds = 1 / priors.BOTH_RESTART_ODDS if both else priors.COMPANION_CHANCE
        share = _with_other_odds(cause, share, at_once - both, odds)
        return _with_other_odds(cause, share, both, priors.BOTH_RESTART_ODDS)
    if same or (cause.usual and any(other.usual for other, _ in others)):
        share = np.array(np.log(priors.COMPANION_CHANCE / len(cause.variants)))
    return share


def _with_other_odds(
    cause: Cause, share: Array, sharing: AbstractSet[Group], odds: float
) -> Array:
    """Log prior of each variant, if the variants `sharing` share the total `odds`."""
    among = [g in sharing for g in cause.variants]
    return np.where(among, np.log(odds / max(len(sharing), 1)), share)


class Sets:
    """Evaluates sets over one Gram matrix, and keeps those that were evaluated.

    Attributes
    ----------
    visited : evaluated sets by their keys
    corrections : difference to add to the score of a set whose own base state is far
        from that of the Gram matrix, by the keys of its causes in the state

    """

    def __init__(self, dictionary: Dictionary, gram: Gram) -> None:
        self.dictionary, self.gram = dictionary, gram
        kinds = np.unique(gram.kind[gram.info > 0])
        self.typical_instability = dictionary.typical_instability * np.isin(
            np.arange(7), kinds
        )
        self.visited: dict[SetKey, Set] = {}
        self.corrections: dict[frozenset[str], float] = {}
        self._weighted: dict[tuple[int, ...], WeightedGram] = {}

    @staticmethod
    def key(members: Iterable[Member]) -> SetKey:
        """Key of a set of these members."""
        return tuple(sorted((c.key, c.variants.index(g)) for c, g in members))

    def evaluate(self, members: tuple[Member, ...], start: Sizes | None = None) -> Set:
        """The set of these members at its most probable sizes, with its score."""
        key = self.key(members)
        if key not in self.visited:
            sizing = Sizing(
                self.dictionary, self.gram, self.typical_instability, members, start
            )
            sizes, score = sizing.run()
            rows = self.gram_at(sizes.instability)
            state = replace(sizing.eliminated(), rows=rows)  # with all columns
            score += self.set_log_prior(members)
            self.visited[key] = Set(members, sizes, score, state)
        return self.visited[key]

    def corrected_score(self, visited: Set) -> float:
        """Score of a set about its own state."""
        return visited.score + self.corrections.get(visited.keys_in_state, 0.0)

    def set_log_prior(self, members: Iterable[Member]) -> float:
        """Log prior probability of the causes of a set."""
        total, before = 0.0, list[Member]()
        for cause, group in members:
            shares = variant_log_priors(cause, before)
            own = shares[cause.variants.index(group)] if shares.ndim else shares
            total += float(own)
            before.append((cause, group))
        return total

    def gram_at(self, instability: tuple[int, ...]) -> WeightedGram:
        """The Gram matrix weighted with the instabilities of some indices; cached."""
        if instability not in self._weighted:
            tau = self.instability_sigma(instability)
            self._weighted[instability] = self.gram.with_instability(tau)
        return self._weighted[instability]

    def instability_sigma(self, instability: Sequence[int]) -> Array:
        """Standard deviation (7,) of instabilities, from indices in `priors.SIZES`."""
        return priors.SIZES[list(instability)] * self.typical_instability

    def instability_log_prior(self, instability: Sequence[int] | Array) -> Any:
        """Log prior of instabilities (..., 7), as `sizing.instability_log_prior`."""
        return instability_log_prior(instability, self.typical_instability)

    def without(self, whole: Set, i: int) -> Set:
        """The set without one of its members."""
        return self.reduced(whole, (*whole.members[:i], *whole.members[i + 1 :]))

    def reduced(self, whole: Set, kept: tuple[Member, ...]) -> Set:
        """The set with only some of its members, evaluated from the sizes of these."""
        return self.evaluate(kept, whole.sizes_of(kept))
