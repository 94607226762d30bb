"""Sinking: the support of a fixture gives way, so its base turns during the session.

Examples are a tripod that sinks into soil, a table that bends and a jack that leaks.
The base turns slowly about its two level axes, i = x and z, mostly in one direction, by
the angles

    theta_i(t) = sum_k a_ik P_k(u),   k = 1 .. 4,   -1 <= u <= 1 over the session,

with Legendre polynomials P_k, and standard deviations of a_ik proportional to
0.2^(k - 1), as for a support that settles with a time constant of one to several times
the session. Every position with known angles is turned by the angles at its time. Their
mean over the session is the base tilt, which is an effect of its own. The rotation of
the base during a turn from one position to the next is part of the scatter of closures.
A device that lies on a soft support without a fixture leans anew in each stop
(`leaning`).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model import priors, resolutions, thresholds
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.effect_columns import effect_basis
from fieldcal.physics.experience_rows import select_rows

NAME = "sinking"


def sinking(table: ColumnTable) -> Group | None:
    """Group of all positions with known angles; None if there are too few.

    None also if the rows are means without times.
    """
    x = table.x
    known = x.oriented & (x.position >= 0)
    if len(np.unique(x.position[known])) < thresholds.MIN_SINKING_POSITIONS:
        return None
    begin, end = float(x.t[known].min()), float(x.t[known].max())
    if begin == end:
        return None
    tilt = effect_basis(catalogue()["base_tilt"], {}, 0)

    def columns(view: RowView) -> Array:
        out = np.zeros((len(view.x), 6, 2 * resolutions.POLYNOMIALS))
        rows = np.flatnonzero(view.nominal.oriented & (view.nominal.position >= 0))
        if not len(rows):
            return out
        oriented = RowView(
            select_rows(view.nominal, rows.tolist()),
            select_rows(view.x, rows.tolist()),
            view.since[:, rows],
            view.state,
        )  # fmt: skip
        per_deg = tilt.evaluate(oriented)
        u = 2 * (view.x.t[rows] - begin) / (end - begin) - 1
        course = legvander(u, resolutions.POLYNOMIALS)[:, 1:]
        out[rows] = (per_deg[..., None] * course[:, None, None]).reshape(
            len(rows), 6, -1
        )
        return out

    at = table.add(General(NAME, columns), 2 * resolutions.POLYNOMIALS)
    fading = priors.SINK_FADING ** np.arange(resolutions.POLYNOMIALS)
    size = np.tile(np.rad2deg(priors.SINK_RAD) * fading, 2)
    return Group(NAME, "", at, size, random=True)
