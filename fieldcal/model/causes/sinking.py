"""Sinking: what a fixture stands on gives way, so its base turns while it is used.

A tripod sinks into soil, a table bends, a jack leaks. The base then turns about its two
level axes, slowly and mostly one way,

    theta_i(t) = sum_k a_ik P_k(u),   k = 1 .. 4,   -1 <= u <= 1 over the session,

with Legendre polynomials P_k and a_ik ~ 0.2^(k - 1), as of what settles within one to
several times the session. Every position of known angles is turned by the tilt of that
moment. The mean is the tilt of the base; of a turn from one position to the next, what
it sinks meanwhile is in what closures scatter by. A device that lies on something soft
by itself leans in each stop anew (`leaning`).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander

from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model import priors
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.columns import General, RowView, effect_basis
from fieldcal.model.turns.turn import select_rows

NAME = "sinking"

POLYNOMIALS = 4
"""Polynomials of each angle."""

MIN_POSITIONS = 4
"""Positions of known angles that tell a base that turns from biases."""


def sinking(table: ColumnTable) -> Group | None:
    """Group of all positions with known angles; None if there are too few.

    None also if nobody knows when each was held: means without times.
    """
    x = table.x
    known = x.oriented & (x.position >= 0)
    if len(np.unique(x.position[known])) < MIN_POSITIONS:
        return None
    begin, end = float(x.t[known].min()), float(x.t[known].max())
    if begin == end:
        return None
    tilt = effect_basis(catalogue()["base_tilt"], {}, 0)

    def columns(view: RowView) -> Array:
        out = np.zeros((len(view.x), 6, 2 * POLYNOMIALS))
        rows = np.flatnonzero(view.nominal.oriented & (view.nominal.position >= 0))
        if not len(rows):
            return out
        some = RowView(
            select_rows(view.nominal, rows.tolist()),
            select_rows(view.x, rows.tolist()),
            view.since[:, rows],
            view.state,
        )  # fmt: skip
        by = tilt.evaluate(some)  # of one degree
        u = 2 * (view.x.t[rows] - begin) / (end - begin) - 1
        course = legvander(u, POLYNOMIALS)[:, 1:]
        out[rows] = (by[..., None] * course[:, None, None]).reshape(len(rows), 6, -1)
        return out

    start = table.add(General(NAME, columns), 2 * POLYNOMIALS)
    fading = priors.SINK_FADING ** np.arange(POLYNOMIALS)
    size = np.tile(np.rad2deg(priors.SINK_RAD) * fading, 2)
    return Group(NAME, "", start + np.arange(len(size)), size, random=True)
