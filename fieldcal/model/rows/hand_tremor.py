"""Hand tremor: a device that is held by hand rotates slightly all the time.

Where orientations are not known, only the length of the force says something about the
accelerometers. On a table its direction stays within the noise of the rows of a window;
in a hand it wanders, and would pass for biases that do. Then each window is one row:
the mean of the force over it is as long as ever, to second order in the angle. The mean
rate over T s is the angle between its ends, over T: of one that wanders by a (rms) it
is off by

    sqrt(2) a / T                                                                  (1)

How slowly hands wander is seen by the accelerometers, in all windows together. Where,
and about which axis, a hand trembles more than that the gyroscopes see: what their rate
sums up to has about a line the variance

    a^2 + N^2 T / 15                                                               (2)

with N the density of white noise, whose sum is a walk.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.core.sampling import rate_of
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.bounds import spans
from fieldcal.model.rows.reduce import Rows, RowSource, averaged, reduce

WANDERS = 6.0
"""Standard deviations of what the squares across the force have too many."""

FEWEST = 4
"""Windows of a device in a hand; what lies still for long drifts by itself."""

MORE = 1.5
"""And by how much more than along the force."""


def rows_of(source: RowSource) -> Rows:
    """Rows of a recording, one for each window of a device held by hand."""
    rows = reduce(source)
    held = np.unique(rows.x.position)
    if not (angle := wander(rows)):
        return rows
    samples = rows.length[:, None] * rate_of(source.block)
    level = [
        np.nanmedian((rows.sd * np.sqrt(samples))[rows.x.position == p], axis=0)
        for p in held
    ]
    bound = spans(source.block, source.about)[held]
    shaken = [rows.x.variance[rows.x.position == p].mean(axis=0) for p in held]
    one = averaged(source, bound, held, np.array(level), rows.noise, np.array(shaken))
    rates = masked(source.block, source.usable).gyr
    unsteady = [
        _unsteady(rates[a:b], length, white)
        for (a, b), length, white in zip(bound, one.length, one.sd[:, 3:], strict=True)
    ]
    slow = np.sqrt(2.0) * angle / one.length[:, None]  # (1)
    one.sd[:, 3:] = np.sqrt(one.sd[:, 3:] ** 2 + slow**2 + np.square(unsteady))
    first = np.searchsorted(rows.x.position, held)
    force = angle * source.about.gravity * np.abs(source.about.nominal["acc_scale"])
    return replace(one, common=rows.common[first], wander=float(force.mean()))


def _unsteady(rates: Array, length: float, white: Array) -> Array:
    """What trembling adds to the mean rates of a window, by axis, (3,) outputs.

    Parameters
    ----------
    rates : (n, 3) outputs, nan where missing
    length : T, s
    white : (3,) deviation of the mean by white noise, N / sqrt(T)

    """
    known = np.isfinite(rates)
    mean = np.nan_to_num(rates).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    off = np.where(known, rates - mean, 0.0)
    angle = np.cumsum(off, axis=0) * (length / len(off))
    part = np.linspace(-1.0, 1.0, len(off))
    line = np.linalg.qr(np.column_stack([np.ones_like(part), part]))[0]
    angle -= line @ (line.T @ angle)
    noise = (white * length) ** 2 / 15
    square = np.maximum((angle**2).mean(axis=0) - noise, 0.0)  # (2)
    out: Array = np.sqrt(2.0 * square) / length  # (1)
    return out


def wander(rows: Rows) -> float:
    """Rms angle by which the force turns within windows, rad; 0 on a table.

    A course that windows share is none of a hand: outputs settle like that.
    """
    x, some = rows.x, rows.used[:, :3].all(axis=1) & ~rows.x.oriented
    held = [some & (x.position == p) for p in np.unique(x.position[some])]
    held = [at for at in held if at.sum() > 1]
    if len(held) < FEWEST:
        return 0.0
    offs = [rows.y[at, :3] - rows.y[at, :3].mean(axis=0) for at in held]
    along, across, dof, angle = 0.0, 0.0, 0.0, []
    for at, off in zip(held, _less_shared(offs), strict=True):
        up = x.f[at][0] / np.linalg.norm(x.f[at][0])
        sd = rows.sd[at, :3]
        part = np.outer(off @ up, up)
        free = (len(off) - 1) * (1 - 1 / len(held))
        along += float(((part / sd) ** 2).sum())
        across += float((((off - part) / sd) ** 2).sum())
        dof += free
        length = np.linalg.norm(rows.y[at, :3].mean(axis=0))
        angle.append(((off - part) ** 2).sum() / (2 * free) / length**2)
    if across / 2 < max(dof + WANDERS * np.sqrt(dof), MORE * along):
        return 0.0
    return float(np.sqrt(np.mean(angle)))


def _less_shared(offs: list[Array]) -> list[Array]:
    """Courses within windows, (n, 3) each, less their mean row by row."""
    longest = max(map(len, offs))
    whole = np.full((len(offs), longest, 3), np.nan)
    for i, off in enumerate(offs):
        whole[i, : len(off)] = off
    shared = np.nanmean(whole, axis=0)
    return [off - shared[: len(off)] for off in offs]
