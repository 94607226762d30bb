"""Scale factors of accelerometers that change while their biases do.

    U_i += sum_k s_ik c_k(t) f_i,   s_ik = N(0, (r b_k / g)^2)                     (1)

c_k(t) are the courses by which the biases change, b_k the sizes of these changes, and r
the change of a scale factor at 1 g as a part of that of a bias. Positions that are
taken once cannot distinguish (1) from constant scale factors, but the next flight
starts with the changed ones. For the temperature, the MPU-6050 states 0.02 %/K, and 35
mg from 25 to 70 degC, which is r = 0.25. A smooth course of biases that no effect
describes is attributed to it, the most frequent cause. A restart, another range or a
calibration by the device itself changes both at once, by sizes that are as alike.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import ACC, CHANNELS, Array, Index
from fieldcal.model import priors
from fieldcal.model.causes.basis import Course, General, RowView
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.evidence.sizing import Member
from fieldcal.physics.effect import BiasChange

ACC_OUTPUTS = len(CHANNELS[ACC])
"""Number of outputs of accelerometers; they come first."""

WARM_SCALE = "warm_scale"
"""Name of these groups."""

COURSES = ("time", "temperature")
"""Functions without physics that may be an effect of the temperature."""


def warm_scale(table: ColumnTable, group: Group) -> Member | None:
    """Change of scale factors that accompanies a group that changes biases.

    Parameters
    ----------
    table : to which the columns are added
    group : the result is None unless scale factors change with the biases that it
        changes, and it is on accelerometers

    """
    if not _changes_scales(group):
        return None
    course, which, size = _courses(table, group)
    if not len(which):
        return None

    def columns(view: RowView) -> Array:
        c_of_t = course.evaluate(view)[:, which]
        out = np.zeros((len(view.x), 6, ACC_OUTPUTS, len(which)))
        for c in range(ACC_OUTPUTS):
            out[:, c, c] = c_of_t * view.x.f[:, [c]]  # (1)
        return out.reshape(len(out), 6, -1)

    count = ACC_OUTPUTS * len(which)
    at = table.add(General(WARM_SCALE, columns), count)
    wide = np.abs(np.outer(table.unit[:ACC_OUTPUTS], priors.SCALE_WARMING * size / G0))
    one = Group(
        WARM_SCALE, "", at, wide.ravel(), group.effect, group.shape, group.origin,
        tuple(np.repeat(range(ACC_OUTPUTS), len(which)).tolist()), fixed_size=1.0,
    )  # fmt: skip
    return Cause(WARM_SCALE, "", 1.0, (one,), "noise"), one


def _changes_scales(group: Group) -> bool:
    """Whether what changes biases changes scale factors as well."""
    effect = group.effect
    if effect is None:
        return group.cause in COURSES
    return isinstance(effect, BiasChange) and effect.with_scales


def _courses(table: ColumnTable, group: Group) -> tuple[Course, Index, Array]:
    """Course of a group, its columns on accelerometers, and sizes of the biases.

    Sizes are in m/s^2.
    """
    first, basis = next(
        (first, basis)
        for first, end, basis in table.basis_ranges()
        if first <= group.columns[0] < end
    )
    if not isinstance(basis, Course):
        raise TypeError(f"{group.cause} is no course of biases")
    channel, number = np.divmod(group.columns - first, basis.width)
    on_acc = channel < ACC_OUTPUTS
    wide = group.own_sigma() / table.unit[channel]
    which, at = np.unique(number[on_acc], return_inverse=True)
    count = np.bincount(at, minlength=len(which))
    size = np.sqrt(np.bincount(at, wide[on_acc] ** 2, len(which)) / count)
    return basis, which, size
