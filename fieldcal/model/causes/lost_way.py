"""A way that was not followed: what one turn was off by, and no other.

Samples are lost while time is counted by them, an output runs against its range, the
device is knocked: the gyroscopes then miss a part of one turn, whatever they are. Seen
from the closure, they were off by a rate w_k on that way alone,

    U_gyr += w_k    between windows k and k + 1                                     (1)

so that all three axes of the closure are free. Without it, the closures of all turns
would scatter as much, or the axes of that turn would have another scale factor.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView

MIN_TURNS = 3
"""Ways of which one may be told from the others."""


def lost_ways(table: ColumnTable) -> Iterator[Cause]:
    """One cause for each way between two windows, of three columns."""
    x, held = table.x, table.window_positions
    middle = np.array([x.t[x.position == p].mean() for p in held])
    first = np.array([(x.t + x.lasts / 2)[x.position == p].max() for p in held[:-1]])
    last = np.array([(x.t - x.lasts / 2)[x.position == p].min() for p in held[1:]])
    long = last - first
    known = np.flatnonzero(long > 0)
    if len(known) < MIN_TURNS:
        return

    def columns(view: RowView) -> Array:
        out = np.zeros((len(view.x), 6, 3 * len(known)))
        for i, k in enumerate(known):
            rows = np.flatnonzero(
                (view.x.position < 0)
                & (view.x.t > middle[k]) & (view.x.t < middle[k + 1])
            )  # fmt: skip
            for c in range(3):
                out[rows, 3 + c, 3 * i + c] = 1.0
        return out

    at = table.add(General("way", columns), 3 * len(known))
    chance = priors.LOST_TURN_CHANCE / len(known)
    for i, k in enumerate(known):
        size = priors.LOST_TURN_RAD / long[k] * np.abs(table.unit[3:])
        ends = (int(held[k]), int(held[k + 1]))
        own = at + 3 * i + np.arange(3)
        group = Group(f"way {k}", "gyr", own, size, moved_positions=ends, random=True)
        yield Cause(group.cause, "gyr", chance, (group,), "noise")
