"""Sets that differ from a given one in their members' parameters, or lack a member."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import LOG_DENSITY, UNIT_INDEX, Member


def drop_superfluous(sets: Sets, members: tuple[Member, ...]) -> Set:
    """Set of some members without those whose removal raises the weight."""
    best = sets.evaluate(members)
    for _ in members:
        reduced = [sets.without(best, i) for i in range(len(best.members))]
        fewer = max(reduced, key=score_of, default=best)
        if fewer.score <= best.score:
            break
        best = fewer
    return best


def visit_variations(sets: Sets, current: Set, top: float) -> None:
    """Visit a set with other parameters of each cause, and without each cause.

    An angle that was set wrongly may be that of another position. Only sets are visited
    that are predicted near the weight `top`.
    """
    least = top - thresholds.ALTERNATIVE_LOG_DISTANCE
    for i, (cause, group) in enumerate(current.members):
        variations = _variations(sets, current, cause, group)
        if not variations:
            continue
        added = _added_log_evidence(current.state.without(group.columns), variations)
        bare = current.score - added[group]
        rest = (*current.members[:i], *current.members[i + 1 :])
        log_prior = sets.set_log_prior(current.members)
        if bare - log_prior + sets.set_log_prior(rest) > least:
            sets.without(current, i)
        for other, gain in added.items():
            if other is not group and bare + gain > least:
                members = list(current.members)
                members[i] = (variations[other], other)
                sets.evaluate(tuple(members), current.sizes)


def _variations(
    sets: Sets, current: Set, cause: Cause, group: Group
) -> dict[Group, Cause]:
    """A group of a set and what may be in its place, each with its cause."""
    if cause.kind == "effect":
        return dict.fromkeys(group.with_same_shape(cause.variants), cause)
    if cause.position < 0:
        return {}
    return {
        other.variants[0]: other
        for other in sets.dictionary.causes
        if other.name_and_part == cause.name_and_part
        and (other is cause or other.key not in current.keys)
    }


def widen_outputs(sets: Sets, current: Set) -> Set:
    """The set with its causes on more outputs, if that raises the weight."""
    for cause, group in current.members:
        own = group.with_same_shape(cause.variants)
        wider = [g for g in own if {*g.params} > {*group.params}]
        if cause.kind != "effect" or not wider:
            continue
        rest = current.state.without(group.columns)
        added = _added_log_evidence(rest, [group, *wider])
        most = max(added, key=lambda g: added[g])
        if most is not group:
            members = tuple((c, most if c is cause else g) for c, g in current.members)
            widened = sets.evaluate(members, current.sizes)
            current = max([current, widened], key=score_of)
    return current


def with_all_parameters(sets: Sets, current: Set) -> Set:
    """The set of the same causes, each with all the parameters that it has."""
    members = tuple((c, c.full_variant(g)) for c, g in current.members)
    return sets.evaluate(members, current.sizes)


def score_of(candidate: Set) -> float:
    """Score of a set, to compare sets by."""
    return candidate.score


def _added_log_evidence(
    rest: Eliminated, groups: Iterable[Group]
) -> dict[Group, float]:
    """Log evidence that each group adds to a set, averaged over its sizes."""
    added: dict[Group, float] = {}
    for group in groups:
        gains = rest.gain_by_size(group.columns, group.own_sigma())
        known = group.fixed_size is not None
        added[group] = float(
            gains[UNIT_INDEX] if known else np.logaddexp.reduce(gains + LOG_DENSITY)
        )
    return added
