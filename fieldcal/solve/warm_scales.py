"""Scale factors of accelerometers that change while their biases do.

    U_i += s_i c(t) f_i,   s_i = N(0, (r b / g)^2)                                 (1)

c(t) is the course by which the temperature changes the biases, b how large the changes
of the biases are, and r the part of that which a scale factor changes by at 1 g. A
position that is taken once cannot tell (1) from other scale factors, and the next
flight starts with what they have become. The MPU-6050 states 0.02 %/K beside 35 mg from
25 to 70 degC, which is r = 0.25.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.model import priors
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView
from fieldcal.model.evidence.sizing import Member
from fieldcal.physics.effect import BiasChange

ACC = 3
"""Outputs of accelerometers, the first ones of all."""

WARM_SCALE = "warm_scale"
"""What these groups are called."""


def warm_scale(table: ColumnTable, group: Group) -> Member | None:
    """What changes the scale factors beside a group that changes the biases.

    Parameters
    ----------
    table : to which the columns are added
    group : none comes back unless it follows the temperature and is on accelerometers

    """
    effect = group.effect
    if not isinstance(effect, BiasChange) or not effect.thermal:
        return None
    some = [i for i, j in enumerate(group.params) if j < ACC]
    if not some:
        return None

    def columns(view: RowView) -> Array:
        seen, out = view.counting_from(group.origin), np.zeros((len(view.x), 6, ACC))
        course = effect.course(seen, group.shape)
        for c in range(ACC):
            out[:, c, c] = course * seen.f[:, c]  # (1)
        return out

    wide = group.sizes(1.0 if group.fixed is None else group.fixed)[some]
    bias = np.abs(wide / table.unit[[group.params[i] for i in some]])
    size = priors.SCALE_WARMS * float(np.sqrt(np.mean(bias**2))) / G0
    at = table.add(General(WARM_SCALE, columns), ACC) + np.arange(ACC)
    one = Group(
        WARM_SCALE, "", at, size * np.abs(table.unit[:ACC]), effect, group.shape,
        group.origin, (0, 1, 2), fixed=1.0,
    )  # fmt: skip
    return Cause(WARM_SCALE, "", 1.0, (one,), "noise"), one
