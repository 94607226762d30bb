"""Hand tremor: a device that is held by hand rotates slightly all the time.

If orientations are not known, only the norm of the force determines the accelerometers.
On a table the direction of the force is constant within the noise of the rows. In a
hand it varies, which would look like a bias that varies. Each window is then a single
row, since the norm of the mean force changes only to second order in the angle. The
mean rate over T s is the difference of the angles at both ends over T. If the angle
varies by a (rms), the error of the mean rate is

    sqrt(2) a / T                                                                  (1)

The accelerometers show the slow part of the tremor, in all windows together. The
gyroscopes show in which windows and about which axes the tremor is larger: the
integrated rate has about a straight line the variance

    a^2 + N^2 T / 15                                                               (2)

with N the density of the white noise, whose integral is a random walk. Tremor is motion
and not noise of the sensors: the gyroscopes follow it from one rest to the next, and
the angle that it has reached at the end of a rest changes the closure of a turn. The
hand also accelerates the device. Along gravity the integral of this is a speed that
returns to zero as the angle does, so (1) and (2) hold with the speed for the mean force
along gravity.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.core.sampling import rate_of
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.bounds import spans
from fieldcal.model.rows.noise import grain_of
from fieldcal.model.rows.reduce import Rows, RowSource, averaged, reduce
from fieldcal.windows.noise import quickest, to_and_fro

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
    bound = spans(source.block, source.about)[held]
    angle, noise = wander(rows), _beside_tremor(source, rows, bound)
    if not angle and noise is None:
        return rows
    samples = rows.length[:, None] * rate_of(source.block)
    level = [
        np.nanmedian((rows.sd * np.sqrt(samples))[rows.x.position == p], axis=0)
        for p in held
    ]
    if noise is not None:
        level, rows = [noise] * len(held), replace(rows, noise=noise)
    shaken = [rows.x.variance[rows.x.position == p].mean(axis=0) for p in held]
    one = averaged(source, bound, held, np.array(level), rows.noise, np.array(shaken))
    block = masked(source.block, source.usable)
    unit = np.abs(source.about.nominal["acc_scale"])
    turned, pushed = np.zeros((len(held), 3)), np.zeros(len(held))
    for i, (a, b) in enumerate(bound):
        white, lasts = one.sd[i], float(one.length[i])
        turned[i] = _tremor_rms(block.gyr[a:b], lasts, white[3:])
        up = one.x.f[i] / np.linalg.norm(one.x.f[i])
        along = (block.acc[a:b] / unit) @ up
        spread = np.array([np.linalg.norm(white[:3] / unit * up)])
        pushed[i] = _tremor_rms(along[:, None], lasts, spread)[0]
    slow = np.sqrt(2 * (angle**2 + turned**2)) / one.length[:, None]  # (1)
    one.sd[:, 3:] = np.hypot(one.sd[:, 3:], slow)
    fast = np.sqrt(2.0) * pushed / one.length  # (1)
    one.sd[:, :3] = np.hypot(one.sd[:, :3], fast[:, None] * unit)
    first = np.searchsorted(rows.x.position, held)
    most = max(angle, float(np.sqrt((turned**2).mean())))
    force = most * source.about.gravity * unit
    return replace(one, common=rows.common[first], wander=float(force.mean()))


def _beside_tremor(
    source: RowSource, rows: Rows, bound: NDArray[np.intp]
) -> Array | None:
    """Noise of one sample beside a tremor, (6,); None where nothing trembles."""
    block = masked(source.block, source.usable)
    free = ~rows.x.oriented.any() and len(bound) >= FEWEST
    if not free or not to_and_fro([block.gyr[a:b] for a, b in bound]):
        return None
    least = grain_of(block, bound)
    both = [
        quickest([triad[a:b] for a, b in bound]) for triad in (block.acc, block.gyr)
    ]
    beside: Array = np.maximum(np.concatenate(both), least)
    return beside


def _tremor_rms(values: Array, length: float, white: Array) -> Array:
    """What trembles sums up to an angle or a speed: its rms about a line, (k,).

    Parameters
    ----------
    values : (n, k) outputs, nan where missing
    length : T, s
    white : (k,) deviation of the mean by white noise, N / sqrt(T)

    """
    known = np.isfinite(values)
    mean = np.nan_to_num(values).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    off = np.where(known, values - mean, 0.0)
    total = np.cumsum(off, axis=0) * (length / len(off))
    part = np.linspace(-1.0, 1.0, len(off))
    line = np.linalg.qr(np.column_stack([np.ones_like(part), part]))[0]
    total -= line @ (line.T @ total)
    noise = (white * length) ** 2 / 15
    out: Array = np.sqrt(np.maximum((total**2).mean(axis=0) - noise, 0.0))  # (2)
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
