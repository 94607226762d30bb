"""Parameters in the one set of axes in which all are stated.

If nobody knows how the device stood, its axes are free: a small rotation of them makes
other parameters of the same device. One set of causes has k31 where another has k13,
and each states the coupling of the gyroscopes in axes of its own. A rotation adds an
antisymmetric matrix to the couplings of both triads. In the axes in which k31 is zero,

    s13 + k31 and s31 - k31                                                         (1)

replace s13 and s31. An effect says what is added to it (`Effect.turned_by`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sets import Set
from fieldcal.model.evidence.sizing import Member


def in_common_axes(fitted: Set, group: Group) -> Group:
    """The group of a set, with the parameters that exist in the common axes alone.

    They have no column, -1.
    """
    if not (group.effect and group.effect.turned_by):
        return group
    column = dict(zip(group.params, group.columns.tolist(), strict=True))
    size = dict(zip(group.params, group.typical.tolist(), strict=True))
    params = sorted({j for j, _, _ in _added(fitted, group)} | set(group.params))
    return replace(
        group,
        params=tuple(params),
        columns=np.array([column.get(j, -1) for j in params]),
        typical=np.array([size.get(j, 0.0) for j in params]),
    )


def parameter_rows(fitted: Set, member: Member, turned: bool) -> Array:
    """Rows (k, a) that give the parameters of a member from the columns of a set.

    The set has the cause by this group or by another one. With `turned`, they are the
    parameters in the common axes, (1).
    """
    state, group, own = fitted.state, member[1], group_in(fitted, member)
    column = dict(zip(own.params or own.columns, own.columns, strict=True))
    wanted = list(group.params or group.columns)
    rows = np.zeros((len(wanted), len(state.columns)))
    for row, param in zip(rows, wanted, strict=True):
        if param in column:
            row[state.places_of(np.array([column[param]]))] = 1.0
    for j, added, sign in _added(fitted, group) if turned else ():
        if j in wanted:
            rows[wanted.index(j)] += sign * pick_columns(fitted, [added])[0]  # (1)
    return rows


def group_in(fitted: Set, member: Member) -> Group:
    """The group by which a set has the cause of a member."""
    (own,) = (g for c, g in fitted.members if c.key == member[0].key)
    return own


def pick_columns(fitted: Set, columns: Iterable[int]) -> Array:
    """Rows (k, a) that pick columns of a set: zeros for one that it does not have.

    A column that occurs twice is the sum of both.
    """
    own = fitted.state.columns
    return np.array([own == c for c in columns], dtype=float).reshape(-1, len(own))


def _added(fitted: Set, group: Group) -> Iterator[tuple[int, int, float]]:
    """Each parameter with the column of the set that is added to it, and the sign."""
    if group.effect is None:
        return
    names = [p.name for p in group.effect.params]
    for name, (cause, gone, sign) in group.effect.turned_by.items():
        for _, there in fitted.members:
            if there.effect is not None and there.cause == cause:
                pairs = zip(there.names, there.columns, strict=True)
                at = [c for n, c in pairs if n == gone]
                yield from ((names.index(name), int(c), sign) for c in at)
