"""Leaning: the support of a device gives way, so the device turns slowly in a stop.

Examples are a vehicle on its tyres, and a box on grass or foam. In a stop whose
orientation is not set by a fixture, the angle about each of two axes across the force
is a random walk about its mean, from the start t_0 to the end t_1 of the stop,

    theta_i(t) = sum_k a_ik cos(pi k u),   u = (t - t_0) / (t_1 - t_0),  a_ik ~ 1 / k,

A device that is turned by theta, rad, about the unit vector e measures

    f' = f - theta e x f,    w' = w + (d theta / dt) e                              (1)

The length of the force does not change; this distinguishes leaning from a bias that
changes. Stops with angles set by a fixture have no such columns. If most stops lean, a
hand holds the device (`hand_tremor`). The orientation of a stop is its mean; the
difference between the mean and the lean at the ends of a turn is part of the scatter of
closures.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.model import priors, resolutions
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.state import perpendicular_vectors


def leaning(table: ColumnTable) -> Group | None:
    """Group of all stops with enough rows; None if there are none."""
    held = np.flatnonzero(table.wander.leans)
    if not len(held):
        return None
    waves = np.ceil(_share(table.wander.leans) * table.wander.leans[held]).astype(int)
    ends = np.array([_ends(table, int(p)) for p in held])
    first = np.cumsum([0, *(2 * waves)])

    def columns(view: RowView) -> Array:
        """Columns (n, 6, k) by (1): for each stop the cosines about both axes."""
        out = np.zeros((len(view.x), 6, first[-1]))
        stops = zip(first[:-1], held, waves, ends, strict=True)
        for at, p, count, (begin, end) in stops:
            rows = np.flatnonzero((view.x.position == p) & ~view.nominal.oriented)
            f, k = view.x.f[rows], np.arange(1, count + 1)
            phase = np.pi * np.outer((view.x.t[rows] - begin) / (end - begin), k)
            speed = -np.pi * k / (end - begin) * np.sin(phase)
            for axis, side in enumerate(perpendicular_vectors(f)):
                about = np.cross(side, f) / (f**2).sum(axis=1, keepdims=True)
                turned = [side[:, :, None] * np.cos(phase)[:, None],
                          about[:, :, None] * speed[:, None]]  # fmt: skip
                cosines = slice(at + axis * count, at + (axis + 1) * count)
                out[rows, :, cosines] = np.concatenate(turned, axis=1)
        out *= view.state.scale[:, None]
        return out

    at = table.add(General("leaning", columns), int(first[-1]))
    size = priors.LEAN_RAD / np.concatenate([[*np.arange(1, n + 1)] * 2 for n in waves])
    return Group("leaning", "", at, size, random=True)


def _share(leans: Index) -> float:
    """Part of the cosines that is used, so that their number stays limited."""
    return min(1.0, resolutions.MAX_COSINES / int(leans.sum()))


def _ends(table: ColumnTable, p: int) -> tuple[float, float]:
    """Instants at which a stop began and ended, s."""
    x = table.x
    rows = x.position == p
    half = x.lasts[rows] / 2
    return float((x.t[rows] - half).min()), float((x.t[rows] + half).max())
