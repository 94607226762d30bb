"""Sets in which the device restarted in a gap, so that all its biases jump.

Step by step they are not found where something else explains the jump of one triad, or
where the rows hardly show it: one triad alone seldom jumps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.search.variations import score_of
from fieldcal.physics.effect import BiasChange


def sets_with_restarts(sets: Sets, current: Set) -> list[Set]:
    """A set with the likeliest jumps in each gap beside its causes, a set each.

    Biases that jump already do so as they do.
    """
    return [
        _with_likeliest_sizes(sets, current, jumps)
        for jumps in _jumps_by_gap(sets.dictionary).values()
    ]


def visit_restart(sets: Sets, current: Set) -> None:
    """Visit a set with jumps of every size in the gap where they are likeliest."""
    gaps = _jumps_by_gap(sets.dictionary)
    found = [_with_likeliest_sizes(sets, current, jumps) for jumps in gaps.values()]
    if not found:
        return
    best = max(range(len(found)), key=lambda i: found[i].score)
    missing = _missing(current, [*gaps.values()][best])
    choices = [[(cause, one) for one in some] for cause, some in missing.items()]
    for members in product(*choices):
        sets.evaluate((*current.members, *members))


def _jumps_by_gap(dictionary: Dictionary) -> dict[float, dict[Cause, list[Group]]]:
    """Jumps of each triad, of every size, by their instant, s."""
    jumps: dict[float, dict[Cause, list[Group]]] = {}
    for cause in dictionary.causes:
        for group in cause.variants:
            if group in cause.expected and isinstance(group.effect, BiasChange):
                (at_s,) = group.shape.values()
                jumps.setdefault(at_s, {}).setdefault(cause, []).append(group)
    return jumps


def _missing(
    current: Set, jumps: Mapping[Cause, Sequence[Group]]
) -> dict[Cause, Sequence[Group]]:
    """Jumps of the causes that a set does not have yet."""
    own = current.keys
    return {cause: some for cause, some in jumps.items() if cause.key not in own}


def _with_likeliest_sizes(
    sets: Sets, current: Set, jumps: Mapping[Cause, Sequence[Group]]
) -> Set:
    """A set and the likeliest jump of each cause, one after the other."""
    for cause, groups in _missing(current, jumps).items():
        each = (sets.evaluate((*current.members, (cause, group))) for group in groups)
        current = max(each, key=score_of)
    return current
