"""A set of causes at other instabilities than its own.

A cause is offered to a set at smaller instabilities as well, since a scatter that the
cause explains is no longer instability. Permanent groups are tried at smaller sizes for
the same reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import LOG_DENSITY, UNIT_INDEX, Sizes
from fieldcal.model.search.instabilities import InstabilityIndices, tried_instabilities

FLICKER_STEPS_DOWN = (1, 2)
"""Steps of `priors.SIZES` by which the size of flicker may decrease when a cause
explains it: at its full size, flicker explains most of a random walk."""


@dataclass(frozen=True, slots=True, eq=False)
class SetAtInstability:
    """A set whose instability, and perhaps calibration, has other sizes.

    Attributes
    ----------
    instability : its indices in `priors.SIZES`
    state : posterior of the set's columns at these sizes
    score : ln of evidence times prior probability at these sizes

    """

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
    sizes = current.sizes
    base = current.score - current.state.score
    base -= sets.instability_log_prior(sizes.instability)
    columns, prior_sigma = current.state.columns, current.state.prior_sigma
    calibrations = [
        (prior_sigma, 0.0),
        with_typical_calibration(sets.dictionary, current),
    ]
    other = None if other_sizes is None else other_sizes.instability
    for instability in tried_instabilities(
        sets.typical_instability, sizes.instability, other
    ):
        lowered = instability != sizes.instability
        rows = sets.gram_at(instability)
        for sigma, cost in (
            calibrations if lowered and calibrations[1][1] else calibrations[:1]
        ):
            state = Eliminated.of(rows, columns, sigma)
            score = base + cost + state.score + sets.instability_log_prior(instability)
            yield SetAtInstability(instability, state, score)
    if other_sizes is None:
        yield from _with_smaller_permanent_groups(sets, current)
    else:
        yield from _with_flicker_of(sets, current, base, other_sizes)


def _with_smaller_permanent_groups(
    sets: Sets, current: Set
) -> Iterator[SetAtInstability]:
    """The set with single permanent groups at smaller sizes.

    At its full size, a permanent group may absorb a cause that changes all axes, or one
    that is a course in time.
    """
    instability = current.sizes.instability
    rows = sets.gram_at(instability)
    for group, place, size in permanent_groups(sets.dictionary, current):
        if group.fixed_size is None and (group.changes_together or not group.in_state):
            # flicker is what few windows have instead of instability
            down = [max(size - d, 0) for d in FLICKER_STEPS_DOWN if group.random]
            for smaller in dict.fromkeys([*down, 0]):
                sigma = current.state.prior_sigma.copy()
                sigma[place] = group.prior_sigma(float(priors.SIZES[smaller]))
                state = Eliminated.of(rows, current.state.columns, sigma)
                lost = LOG_DENSITY[smaller] - LOG_DENSITY[size]
                score = current.score - current.state.score + state.score
                yield SetAtInstability(instability, state, score + lost)


def _with_flicker_of(
    sets: Sets, current: Set, base: float, other_sizes: Sizes
) -> Iterator[SetAtInstability]:
    """The set with the flicker sizes of another set, if it has flicker.

    `base` is the set's log prior without that of its instability.
    """
    sigma, changed = current.state.prior_sigma.copy(), False
    instability = other_sizes.instability
    pairs = zip(
        permanent_groups(sets.dictionary, current),
        other_sizes.calibration,
        strict=True,
    )
    for (group, place, size), other in pairs:
        if group.random and group.fixed_size is None and other != size:
            sigma[place] = group.prior_sigma(float(priors.SIZES[other]))
            base += float(LOG_DENSITY[other] - LOG_DENSITY[size])
            changed = True
    if changed:
        rows = sets.gram_at(instability)
        state = Eliminated.of(rows, current.state.columns, sigma)
        score = base + state.score + sets.instability_log_prior(instability)
        yield SetAtInstability(instability, state, score)


def with_typical_calibration(
    dictionary: Dictionary, current: Set
) -> tuple[Array, float]:
    """Prior sizes with no calibration below its typical size, and their cost, ln.

    If a large instability absorbs all differences, the most probable sizes of the
    calibration are too small.
    """
    prior_sigma, cost = current.state.prior_sigma.copy(), 0.0
    for group, place, size in permanent_groups(dictionary, current):
        if group.fixed_size is None and size < UNIT_INDEX:
            prior_sigma[place] = group.prior_sigma(float(priors.SIZES[UNIT_INDEX]))
            cost += float(LOG_DENSITY[UNIT_INDEX] - LOG_DENSITY[size])
    return prior_sigma, cost


def permanent_groups(
    dictionary: Dictionary, current: Set
) -> Iterator[tuple[Group, slice, int]]:
    """Permanent groups, their places in the set's columns, and their size indices."""
    first = 0
    groups, sizes = dictionary.always, current.sizes.calibration
    for group, size in zip(groups, sizes, strict=True):
        yield group, slice(first, first := first + len(group.columns)), size
