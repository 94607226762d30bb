"""Groups that a device may have although a set does not contain them.

They have a known prior size, and are eliminated beside the set's own columns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set


def groups_not_in(fitted: Set, more: Sequence[Group]) -> list[Group]:
    """Groups, each named by its part, of effects that a set does not contain."""
    names = {cause.name for cause, _ in fitted.members}
    return [group for group in more if group.part not in names]


def parameters_not_in(fitted: Set, more: Sequence[Group]) -> Iterator[Group]:
    """The same, and of effects that it contains the parameters that it leaves out."""
    held = {cause.name: group.params for cause, group in fitted.members}
    for group in more:
        if group.part not in held:
            yield group
            continue
        lacks = ~np.isin(group.params, held[group.part])
        if lacks.any():
            yield replace(
                group,
                columns=group.columns[lacks],
                typical=group.typical[lacks],
                params=tuple(np.array(group.params)[lacks].tolist()),
            )


def eliminate_with(fitted: Set, more: Sequence[Group]) -> Eliminated:
    """Eliminate a set's columns and further groups, each with its typical sizes."""
    state = fitted.state
    columns = np.concatenate([state.columns, *(group.columns for group in more)])
    sizes = np.concatenate([state.prior_sigma, *(group.typical for group in more)])
    return Eliminated.of(state.rows, columns, sizes)
