"""Hysteresis of the accelerometers: what the last turn leaves in their biases.

    U_i += h_i clip((f_i - f_i,before) / g, -1, 1)

f_before is the force in the position before; in the first position it is not known, and
the term is part of the bias. A suspension that was bent one way does not return as far
as from the other, and a smaller loop leaves less. Source: IEEE Std 1293, hysteresis
error, which is that of the whole range.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView


def hysteresis(table: ColumnTable, size: float) -> Group:
    """The columns of three accelerometers, of a known size, m/s^2."""
    held = np.unique(table.x.position[table.x.position >= 0])
    force = np.array([table.x.f[table.x.position == p].mean(axis=0) for p in held])

    def columns(view: RowView) -> Array:
        x, out = view.x, np.zeros((len(view.x), 6, 3))
        planned = (x.position < 0) & x.oriented  # a position that may come last
        reached = np.flatnonzero((x.position > held[0]) | planned)
        last = np.where(planned, len(held), np.searchsorted(held, x.position))[reached]
        change = x.f[reached] - force[last - 1]
        for c in range(3):
            out[reached, c, c] = np.nan_to_num(np.clip(change[:, c] / G0, -1.0, 1.0))
        return out

    at = table.add(General("hysteresis", columns), 3) + np.arange(3)
    wide = size * np.abs(table.unit[:3])
    return Group("factory", "hysteresis", at, wide, fixed_size=1.0)
