"""Effect of the filters of the sensors on a turn.

The outputs are the motion, convolved with the impulse response h of a filter. h has the
mean d, s, and about it the variance v, s^2, the third moment c, s^3, and the fourth
moment q, s^4. With r = q - 6 v^2, the motion follows from the outputs as

    f(t) = U - v/2 U'' + c/6 U''' - r/24 U'''' + ...,    w likewise from W          (1)

where U and its derivatives by time are those at t + d. The delay d shifts the whole
turn and leaves its closure as it is. The term with w'' changes the closure by

    integral R^T w'' dt = -integral R^T (w x w') dt                                 (2)

for a device that rests at both ends. This is zero for a turn about one axis, and not
zero for a turn about two axes at once. A low-pass of first order has v = tau^2, c = 2
tau^3 and r = 3 tau^4; a mean over L seconds has v = L^2/12, c = 0 and r = -7 L^4/240; a
Butterworth filter has v = 0.

Source: moments of an impulse response about its mean, and the inverse of the series;
(2) by parts, as R^T' = R^T [w x].
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.derivative import derivative
from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import priors
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable

FILTERED = "bandwidth"
"""Part of the group; the id of the effect of such filters in the catalogue."""


def filtered_turns(table: ColumnTable) -> Group:
    """Group with six columns: v, c and r, each of accelerometers and of gyroscopes."""
    at = table.add(General(FILTERED, _filter_columns, needs_whole_turn=True), 6)
    tau = priors.FILTERED_S
    size = np.repeat([tau**2, 2 * tau**3, 3 * tau**4], 2)
    return Group("device", FILTERED, at, size, fixed_size=1.0)


def _filter_columns(view: RowView) -> Array:
    """Derivatives (n, 6, 6) of the outputs by v, c and r, (1).

    At the n edges of a turn; zero in windows.
    """
    x, out = view.x, np.zeros((len(view.x), 6, 6))
    if not x.w_dot.any() or np.any(x.position >= 0):
        return out
    change = np.hstack([derivative(x.t, x.f), x.w_dot]) * view.state.scale
    change[[0, -1]] = 0.0  # at rest there, so that the sum is all of (2)
    term = derivative(x.t, change) / 2
    for k in range(3):
        for i, triad in enumerate((ACC, GYR)):
            out[:, triad, 2 * k + i] = term[:, triad]
        at_rest = np.pad(term[1:-1], ((1, 1), (0, 0)))
        term = -derivative(x.t, at_rest) / (k + 3)
    return out
