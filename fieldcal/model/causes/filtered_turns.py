"""What a filter of the sensors makes of a turn.

Outputs are the motion as an impulse response h lets it through, which is late by its
mean, and wide by its variance v, s^2:

    U(t) = f(t - d) + v/2 f''(t - d) + ...,    W(t) = w(t - d) + v/2 w''(t - d)     (1)

The delay shifts a whole turn. Of w'', however, the closure keeps

    integral R^T w'' dt = -integral R^T (w x w') dt                                 (2)

for a device that rests at both ends: nothing of a turn about one axis, something of one
about two at once. v is tau^2 of a low-pass of first order, L^2/12 of a mean over L, and
zero of a Butterworth filter. Source: cumulants of an impulse response, to second order;
(2) by parts, as R^T' = R^T [w x].
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView

FILTERED = "filtered_turns"
"""Name of the group."""


def filtered_turns(table: ColumnTable) -> Group:
    """Columns of v of the accelerometers and of the gyroscopes, which nobody knows."""
    at = table.add(General(FILTERED, _curved), 2) + np.arange(2)
    size = np.full(2, priors.FILTERED_S**2)
    return Group("device", FILTERED, at, size, fixed=1.0)


def _curved(view: RowView) -> Array:
    """Half of f'' and of w'' at the edges of a turn, (n, 6, 2), (1); none at rest."""
    x, out = view.x, np.zeros((len(view.x), 6, 2))
    if not x.w_dot.any() or np.any(x.position >= 0):
        return out
    slopes = np.hstack([np.gradient(x.f, x.t, axis=0), x.w_dot])
    slopes[[0, -1]] = 0.0  # it rests there, so that all of (2) is seen
    bent = np.gradient(slopes, x.t, axis=0) / 2 * view.state.scale
    out[:, ACC, 0], out[:, GYR, 1] = bent[:, ACC], bent[:, GYR]
    return out
