"""What a filter of the sensors makes of a turn.

Outputs are the motion as an impulse response h lets it through, which is late by its
mean d, wide by its variance v, s^2, and skew by its third moment c, s^3. Where the
fourth is q, the motion follows from the outputs, r = q - 6 v^2, as

    f = U - v/2 U'' + c/6 U''' - r/24 U'''' + ...,    w likewise of W               (1)

with what comes d later on the right. The delay shifts a whole turn. Of w'', however,
the closure keeps

    integral R^T w'' dt = -integral R^T (w x w') dt                                 (2)

for a device that rests at both ends: nothing of a turn about one axis, something of one
about two at once. Of a low-pass of first order v is tau^2, c 2 tau^3 and r 3 tau^4; of
a mean over L they are L^2/12, 0 and -7 L^4/240; of a Butterworth filter v is 0. Source:
moments of an impulse response about its mean, and the inverse of the series; (2) by
parts, as R^T' = R^T [w x].
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.derivative import derivative
from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView

FILTERED = "bandwidth"
"""Name of the group, which is that of the filter's effect in the catalogue."""


def filtered_turns(table: ColumnTable) -> Group:
    """Group with columns of v, c and r, each of accelerometers and of gyroscopes."""
    at = table.add(General(FILTERED, _bent, needs_whole_turn=True), 6) + np.arange(6)
    tau = priors.FILTERED_S
    size = np.repeat([tau**2, 2 * tau**3, 3 * tau**4], 2)
    return Group("device", FILTERED, at, size, fixed_size=1.0)


def _bent(view: RowView) -> Array:
    """Derivatives by v, c and r at the edges of a turn, (n, 6, 6), (1); 0 at rest."""
    x, out = view.x, np.zeros((len(view.x), 6, 6))
    if not x.w_dot.any() or np.any(x.position >= 0):
        return out
    change = np.hstack([derivative(x.t, x.f), x.w_dot]) * view.state.scale
    change[[0, -1]] = 0.0  # it rests there, so that all of (2) is seen
    bent = derivative(x.t, change) / 2
    for k in range(3):
        for i, triad in enumerate((ACC, GYR)):
            out[:, triad, 2 * k + i] = bent[:, triad]
        at_rest = np.pad(bent[1:-1], ((1, 1), (0, 0)))
        bent = -derivative(x.t, at_rest) / (k + 3)
    return out
