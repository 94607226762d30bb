"""Puts the causes of two sessions into both of them, so that they can be compared.

These are the causes in the best set of either. Where one session has a cause and the
other an alias of it, the alias is replaced: otherwise the same physics would be found
in each session under another name. If the two show different parameters of an effect,
both get all of its parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.against.side import DiagnosedRecording
from fieldcal.against.widened import WidenedSet, widen_set
from fieldcal.diagnosis.explain import Explanation
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.sizing import Member


class CausePairing:
    """Two sessions with the same causes in both.

    Attributes
    ----------
    real, sim : both diagnosed recordings
    keys : of the causes, in order
    widened : both sessions with all causes
    instead : name of the replaced alias, by the name of the cause that replaces it

    """

    def __init__(self, real: DiagnosedRecording, sim: DiagnosedRecording) -> None:
        self.real, self.sim = real, sim
        self.later = sim.start - real.start
        self.instead: dict[str, str] = {}
        ours = _best_members(real.explanation)
        theirs = _best_members(sim.explanation)
        ours, lent = self._renamed(ours, theirs, real.explanation)
        theirs, borrowed = self._renamed(theirs, [*ours, *lent], sim.explanation)
        ours, theirs, whole = _with_all_parameters(
            ours, theirs, real.explanation, sim.explanation
        )
        self.ours, self.theirs = ours, theirs
        for_us = _members_lacking(ours, [*lent, *theirs, *borrowed, *whole])
        for_them = _members_lacking(theirs, [*borrowed, *ours, *lent, *whole])
        self.widened = (
            widen_set(real.explanation, ours, for_us, -self.later),
            widen_set(sim.explanation, theirs, for_them, self.later),
        )
        sets = (one.set.members for one in self.widened)
        self.keys = list(dict.fromkeys(c.key for s in sets for c, _ in s))

    def _renamed(
        self, own: list[Member], other: Sequence[Member], explanation: Explanation
    ) -> tuple[list[Member], list[Member]]:
        """Replace own causes by their aliases among the other session's causes.

        Returns the remaining own causes, and those that replace the others.
        """
        names = {c.name for c, _ in own}
        kept, taken = list(own), list[Member]()
        for name in list(names):
            stands = explanation.posterior.alternatives.get(name, {})
            for alias in stands:
                theirs = [m for m in other if m[0].name == alias]
                if alias in names or not theirs or name in {c.name for c, _ in other}:
                    continue
                kept = [m for m in kept if m[0].name != name]
                taken += theirs
                self.instead[alias] = name
                break
        return kept, taken

    def with_shape_of(self, key: str) -> list[tuple[WidenedSet, WidenedSet]]:
        """Both sessions with one cause at the shape of the one, the other, and both.

        Empty if the cause has no shape, or if only one session found it.
        """
        mine, yours = (
            next((m for m in some if m[0].key == key), None)
            for some in (self.ours, self.theirs)
        )
        if mine is None or yours is None or not mine[1].shape or mine[1].effect is None:
            return []
        real, sim = self.widened
        others = [m for m in self.theirs if m is not yours]
        at_ours = widen_set(self.sim.explanation, others, [mine], self.later)
        ours = [m for m in self.ours if m is not mine]
        at_theirs = widen_set(self.real.explanation, ours, [yours], -self.later)
        out = [(real, at_ours), (at_theirs, sim)]
        if (both := _shape_of_both(mine[1], yours[1])) is not None:
            member = (mine[0], both)
            out.append(
                (
                    widen_set(self.real.explanation, ours, [member], 0.0),
                    widen_set(self.sim.explanation, others, [member], self.later),
                )
            )
        return out


def _shape_of_both(mine: Group, yours: Group) -> Group | None:
    """A cause at the time constant that both sessions show, by their uncertainties.

    None if one of them does not tell it, or if its shape is an instant.
    """
    if mine.begins_within or len(mine.shape) != 1:
        return None
    (name,) = mine.shape
    sigma = np.array([mine.shape_sigma(name), yours.shape_sigma(name)])
    if not np.isfinite(sigma).all():
        return None
    value = np.array([mine.shape[name], yours.shape[name]])
    weight = np.square(value / np.maximum(sigma, 1e-9 * value))
    mean = float(np.exp(np.average(np.log(value), weights=weight)))
    return replace(mine, shape={name: mean})


def _best_members(explanation: Explanation) -> list[Member]:
    return list(explanation.best.set.members)


def _members_lacking(own: Sequence[Member], others: Sequence[Member]) -> list[Member]:
    """Members of `others` that are not in `own`, each once."""
    keys = {c.key for c, _ in own}
    return list({c.key: (c, g) for c, g in others if c.key not in keys}.values())


def _with_all_parameters(
    ours: list[Member], theirs: list[Member], real: Explanation, sim: Explanation
) -> tuple[list[Member], list[Member], list[Member]]:
    """Split off the causes of which both have different parameters.

    Returns the remaining causes of both, and those causes with all parameters.
    """
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
    """The group with all parameters of its cause and an unchanged shape."""
    widest = max(cause.variants, key=lambda v: len(v.params))
    return replace(widest, shape=group.shape, origin=group.origin)
