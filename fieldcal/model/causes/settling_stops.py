"""Settling stops: the device goes on turning for seconds after it was put down.

Foam, grass, a hand that lets go and the joints of a fixture give way quickly first and
slowly then. In a stop of unknown orientation, the angle about each of three axes, two
across the force and one along it, is

    theta_i(t) = sum_k a_ik exp(-(t - t_0) / tau_k),                                (1)

t_0 the start of the stop, with the time constants of `resolutions.STOP_SETTLING_S`, of
which a sum follows any between them. A device that is turned so measures what (1) of
`leaning` says. Joints whose turns are known have an effect of their own
(`joint_creep`).
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, resolutions
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.state import perpendicular_vectors


def settling_stops(table: ColumnTable) -> Group | None:
    """Group of all stops in which the device leans; None if there are none."""
    held = np.flatnonzero(table.wander.leans)
    if not len(held):
        return None
    tau = np.array(resolutions.STOP_SETTLING_S)
    each = 3 * len(tau)

    def columns(view: RowView) -> Array:
        """Columns (n, 6, k) by (1)."""
        out = np.zeros((len(view.x), 6, each * len(held)))
        for at, p in zip(range(0, out.shape[2], each), held, strict=True):
            rows = np.flatnonzero((view.x.position == p) & ~view.nominal.oriented)
            if len(rows):
                out[rows, :, at : at + each] = _of_stop(view, rows, tau)
        out *= view.state.scale[:, None]
        return out

    at = table.add(General("settling_stops", columns), each * len(held))
    size = np.full(len(at), priors.STOP_SETTLING_RAD)
    return Group("settling_stops", "", at, size, random=True)


def _of_stop(view: RowView, rows: Index, tau: Array) -> Array:
    """Columns of one stop, by axis and time constant, (m, 6, k)."""
    f, t, half = view.x.f[rows], view.x.t[rows], view.x.lasts[rows] / 2
    part = np.maximum(half[:, None] / tau, 1e-9)
    since = (t - (t - half).min())[:, None]
    theta = np.exp(-since / tau) * np.sinh(part) / part  # a row is a mean over its time
    norm = np.linalg.norm(f, axis=1, keepdims=True)
    across = [(side, np.cross(side, f) / norm**2) for side in perpendicular_vectors(f)]
    out = []
    for side, axis in (*across, (np.zeros_like(f), f / norm)):
        turned = side[:, :, None] * theta[:, None]
        speed = -axis[:, :, None] * (theta / tau)[:, None]
        out.append(np.concatenate([turned, speed], axis=1))
    return np.concatenate(out, axis=2)
