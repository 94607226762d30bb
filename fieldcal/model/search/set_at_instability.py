"""A set of causes at other instabilities than its own.

A cause is offered to a set at smaller instabilities as well, since a scatter that the
cause explains is no longer instability. Permanent groups are tried at smaller sizes for
the same reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors, resolutions, tolerances
from fieldcal.model.causes.cause import CLOSURE, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import UNIT_INDEX, Sizes

InstabilityIndices = tuple[int, ...]
"""Indices of instabilities in `priors.SIZES`, (7,)."""

LOWERED_TOGETHER = ((0, 1, 2), (3, 4, 5, 6))
"""Instabilities that decrease together: of a triad; closures with the gyroscopes."""


def tried_instabilities(
    typical: Array, instability: InstabilityIndices, other: InstabilityIndices | None
) -> list[InstabilityIndices]:
    """A set's instability, and that of another set or some smaller ones.

    `typical` (7,) is the typical instability, 0 where there is none.
    """
    if other is not None:
        return list(dict.fromkeys([instability, other]))
    tried = [instability]
    for lowered in LOWERED_TOGETHER if typical.any() else ():
        for down in resolutions.INSTABILITY_STEPS_DOWN:
            tried.append(lowered_instability(instability, lowered, down))
    acc = LOWERED_TOGETHER[0]
    if typical[CLOSURE] and max(instability[c] for c in acc) > UNIT_INDEX:
        steady = lowered_instability(
            instability, acc, resolutions.INSTABILITY_STEPS_DOWN[-1]
        )
        tried += [
            steady[:CLOSURE] + (max(steady[CLOSURE], UNIT_INDEX + up),)
            for up in resolutions.CLOSURE_STEPS_UP
        ]
    return list(dict.fromkeys(tried))


def unlike_instabilities(
    sets: Sets, tried: Sequence[InstabilityIndices]
) -> list[InstabilityIndices]:
    """Some instabilities without those that the means cannot tell from another.

    The first is that of a set, and stays. Of those at which all means have nearly the
    same variance, the likeliest before the rows are seen: at each, a cause would add
    the same evidence.
    """
    kept: dict[InstabilityIndices, Array] = {}
    for one in sorted(tried[1:], key=lambda i: -sets.instability_log_prior(i)):
        variance = sets.gram.relative_variance(sets.instability_sigma(one))
        if not any(
            np.allclose(variance, other, rtol=tolerances.SAME_VARIANCE, atol=0.0)
            for other in kept.values()
        ):
            kept[one] = variance
    return [*tried[:1], *(one for one in tried[1:] if one in kept)]


def lowered_instability(
    instability: InstabilityIndices, lowered: Sequence[int], down: int
) -> InstabilityIndices:
    """Instabilities with those of the numbers `lowered` lowered by `down` steps."""
    return tuple(
        max(size - down, 0) if i in lowered else size
        for i, size in enumerate(instability)
    )


@dataclass(frozen=True, slots=True, eq=False)
class SetAtInstability:
    """A set whose instability, and perhaps calibration, has other sizes.

    Attributes
    ----------
    calibration, instability : their indices in `priors.SIZES`
    state : posterior of the set's columns at these sizes
    score : ln of evidence times prior probability at these sizes

    """

    calibration: tuple[int, ...]
    instability: InstabilityIndices
    state: Eliminated
    score: float


def at_tried_instabilities(
    sets: Sets, current: Set, other_sizes: Sizes | None
) -> Iterator[SetAtInstability]:
    """A set at its own sizes and at those that a further cause may need.

    With `other_sizes`, the sizes of another set, only the instability and the flicker
    of that set are tried in addition to the set's own.
    """
    own, state = current.sizes, current.state
    few = sets.gram.select_columns(state.columns)
    base = current.score - state.score - sets.instability_log_prior(own.instability)

    def at(
        instability: InstabilityIndices, calibration: Sequence[int]
    ) -> SetAtInstability:
        rows = sets.gram_at(instability)
        prior_sigma, cost = _with_sizes(sets.dictionary, current, calibration)
        there = Eliminated.of(rows.among(few), state.columns, prior_sigma)
        there = replace(there, rows=rows)
        score = base + cost + there.score + sets.instability_log_prior(instability)
        return SetAtInstability(tuple(calibration), instability, there, score)

    wide = _typical_sizes(current)
    other = None if other_sizes is None else other_sizes.instability
    tried = tried_instabilities(sets.typical_instability, own.instability, other)
    for instability in unlike_instabilities(sets, tried):
        yield at(instability, own.calibration)
        if wide != own.calibration and instability != own.instability:
            yield at(instability, wide)
    if other_sizes is None:
        for sizes in _smaller_permanent_groups(sets.dictionary, current):
            yield at(own.instability, sizes)
        return
    always = zip(
        sets.dictionary.always, own.calibration, other_sizes.calibration, strict=True
    )
    flicker = tuple(theirs if g.random else ours for g, ours, theirs in always)
    if flicker != own.calibration:
        yield at(other_sizes.instability, flicker)


def _smaller_permanent_groups(
    dictionary: Dictionary, current: Set
) -> Iterator[list[int]]:
    """Sizes of the permanent groups, with a single one of them smaller.

    At its full size, a permanent group may absorb a cause that changes all axes, or one
    that is a course in time.
    """
    sizes = list(current.sizes.calibration)
    for i, group in enumerate(dictionary.always):
        if group.fixed_size is None and (group.changes_together or not group.in_state):
            # flicker is what few windows have instead of instability
            down = [
                max(sizes[i] - d, 0)
                for d in resolutions.FLICKER_STEPS_DOWN
                if group.random
            ]
            for smaller in dict.fromkeys([*down, 0]):
                yield [*sizes[:i], smaller, *sizes[i + 1 :]]


def with_typical_calibration(
    dictionary: Dictionary, current: Set
) -> tuple[Array, float]:
    """Prior sizes with no calibration below its typical size, and their cost, ln.

    If a large instability absorbs all differences, the most probable sizes of the
    calibration are too small.
    """
    return _with_sizes(dictionary, current, _typical_sizes(current))


def _typical_sizes(current: Set) -> tuple[int, ...]:
    """Sizes of the permanent groups, none below its typical size."""
    return tuple(max(size, UNIT_INDEX) for size in current.sizes.calibration)


def _with_sizes(
    dictionary: Dictionary, current: Set, sizes: Sequence[int]
) -> tuple[Array, float]:
    """Prior sizes with other sizes of the permanent groups, and their cost, ln."""
    prior_sigma, cost = current.state.prior_sigma.copy(), 0.0
    own = permanent_groups(dictionary, current)
    for (group, place, before), size in zip(own, sizes, strict=True):
        if group.fixed_size is None and size != before:
            prior_sigma[place] = group.prior_sigma(float(priors.SIZES[size]))
            cost += float(group.log_density[size] - group.log_density[before])
    return prior_sigma, cost


def permanent_groups(
    dictionary: Dictionary, current: Set
) -> Iterator[tuple[Group, slice, int]]:
    """Permanent groups, their places in the set's columns, and their size indices."""
    first = 0
    groups, sizes = dictionary.always, current.sizes.calibration
    for group, size in zip(groups, sizes, strict=True):
        yield group, slice(first, first := first + len(group.columns)), size
