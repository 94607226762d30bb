"""Errors of the gyroscopes in a single turn, which leave its closure free.

The gyroscopes miss a part of one turn if samples are lost while time is counted by
samples, if an output reaches the end of its range, or if the device is knocked. In the
closure this is an error of the rate, w_k in rad/s, during that turn alone,

    U_gyr += w_k    between windows k and k + 1                                     (1)

so that all three axes of its closure are free. Without this cause, the closures of all
turns would have a larger scatter, or the gyroscopes a wrong scale factor on the axes of
that turn.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.column_table import ColumnTable


def turn_gyro_errors(table: ColumnTable) -> Iterator[Cause]:
    """One cause for each turn between two windows, with three columns of rad/s."""
    x, held = table.x, table.window_positions
    middle = np.array([x.t[x.position == p].mean() for p in held])
    first = np.array([(x.t + x.lasts / 2)[x.position == p].max() for p in held[:-1]])
    last = np.array([(x.t - x.lasts / 2)[x.position == p].min() for p in held[1:]])
    seconds = last - first
    turns = np.flatnonzero(seconds > 0)
    if len(turns) < thresholds.MIN_ALIKE:
        return

    def columns(view: RowView) -> Array:
        """Columns (n, 6, 3 turns): 1 for each gyroscope in the rows of each turn."""
        out = np.zeros((len(view.x), 6, 3 * len(turns)))
        for i, k in enumerate(turns):
            rows = np.flatnonzero(
                (view.x.position < 0)
                & (view.x.t > middle[k]) & (view.x.t < middle[k + 1])
            )  # fmt: skip
            for c in range(3):
                out[rows, 3 + c, 3 * i + c] = 1.0
        return out

    at = table.add(General("way", columns), 3 * len(turns))
    chance = priors.LOST_TURN_CHANCE / len(turns)
    for i, k in enumerate(turns):
        size = priors.LOST_TURN_RAD / seconds[k] * np.abs(table.unit[3:])
        ends = (int(held[k]), int(held[k + 1]))
        own = at[3 * i : 3 * i + 3]
        group = Group(f"way {k}", "gyr", own, size, moved_positions=ends, random=True)
        yield Cause(group.cause, "gyr", chance, (group,), "noise")
