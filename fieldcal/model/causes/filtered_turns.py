"""What a filter of the sensors makes of a turn.

Outputs are the motion as an impulse response h lets it through, which is late by its
mean d, wide by its variance v, s^2, and skew by its third cumulant c, s^3:

    U = f + v/2 f'' - c/6 f''' + ...,    W = w + v/2 w'' - c/6 w''' + ...           (1)

with what was d ago on the right. The delay shifts a whole turn. Of w'', however, the
closure keeps

    integral R^T w'' dt = -integral R^T (w x w') dt                                 (2)

for a device that rests at both ends: nothing of a turn about one axis, something of one
about two at once. Of a low-pass of first order v is tau^2 and c 2 tau^3; of a mean over
L they are L^2/12 and 0; of a Butterworth filter v is 0. Source: cumulants of an impulse
response, to third order; (2) by parts, as R^T' = R^T [w x].
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView

FILTERED = "bandwidth"
"""Name of the group: the effect of the catalogue that a filter is."""


def filtered_turns(table: ColumnTable) -> Group:
    """Columns of v of the accelerometers and of the gyroscopes, then of c of both."""
    at = table.add(General(FILTERED, _bent, along=True), 4) + np.arange(4)
    tau = priors.FILTERED_S
    size = np.array([tau**2, tau**2, 2 * tau**3, 2 * tau**3])
    return Group("device", FILTERED, at, size, fixed=1.0)


def _bent(view: RowView) -> Array:
    """By v and c at the edges of a turn, (n, 6, 4), (1); nothing at rest."""
    x, out = view.x, np.zeros((len(view.x), 6, 4))
    if not x.w_dot.any() or np.any(x.position >= 0):
        return out
    change = np.hstack([np.gradient(x.f, x.t, axis=0), x.w_dot]) * view.state.scale
    change[[0, -1]] = 0.0  # it rests there, so that all of (2) is seen
    second = np.gradient(change, x.t, axis=0)
    third = np.gradient(np.pad(second[1:-1], ((1, 1), (0, 0))), x.t, axis=0)
    for i, triad in enumerate((ACC, GYR)):
        out[:, triad, i] = second[:, triad] / 2
        out[:, triad, 2 + i] = -third[:, triad] / 6
    return out
