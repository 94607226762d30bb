"""Hysteresis of the accelerometers: a part of their bias depends on the last turn.

    U_i += h_i clip((f_i - f_i,before) / g, -1, 1)

f_i,before is the force along axis i in the previous position, m/s^2, and h_i the
hysteresis, m/s^2. In the first position f_i,before is not known, and the term is part
of the bias. A suspension returns to a position that depends on the side from which the
force came; the difference is smaller after a smaller change. Source: IEEE Std 1293,
whose hysteresis error is that of a cycle over the whole range.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable


def hysteresis(table: ColumnTable, size: float) -> Group:
    """Group of the three accelerometers; `size` is the sigma of h, m/s^2."""
    held = np.unique(table.x.position[table.x.position >= 0])
    force = np.array([table.x.f[table.x.position == p].mean(axis=0) for p in held])

    def columns(view: RowView) -> Array:
        x, out = view.x, np.zeros((len(view.x), 6, 3))
        planned = (x.position < 0) & x.oriented  # a further position at the end
        reached = np.flatnonzero((x.position > held[0]) | planned)
        last = np.where(planned, len(held), np.searchsorted(held, x.position))[reached]
        change = x.f[reached] - force[last - 1]
        for c in range(3):
            out[reached, c, c] = np.nan_to_num(np.clip(change[:, c] / G0, -1.0, 1.0))
        return out

    at = table.add(General("hysteresis", columns), 3)
    wide = size * np.abs(table.unit[:3])
    return Group("factory", "hysteresis", at, wide, fixed_size=1.0)
