"""Where a recording stands beside a reference: delay, clock rate, axes.

With x the outputs of a triad, less what changes slowly, of covariance A, and z_j one
channel of the reference, of variance v_j, the part of z_j that a turned, scaled triad
can make is, at each shift l,

    R_j^2(l) = c_j(l)^T A^-1 c_j(l) / v_j,    c_j(l) = cov(x(t), z_j(t - l))        (1)

however the axes lie. The shift of the largest -sum_j ln(1 - R_j^2) is the delay; those
of parts of the recording tell the drift; and the turn between the axes is the one that
brings the channels of the reference nearest to the triads (Wahba's problem),

    R = argmax tr(R^T B),    B = sum of W c_j e_j^T over both triads                 (2)

with W one over the variance of what the reference does not make of each output. Source:
multiple correlation; F. Markley 1988 for (2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.special import chdtri

from fieldcal.against.motion.coherence import common_hz
from fieldcal.core.errors import InputError
from fieldcal.core.samples import ACC, GYR, Array, Block
from fieldcal.model.rows.motion import Alignment

TRIADS = (ACC, GYR)

GRID_HZ = 25.0
"""Samples a second that are correlated: bodies move more slowly than half of it."""

SLOW_S = 8.0
"""What changes more slowly counts for nothing, s: biases do."""

PARTS, NEAR_S = 5, 1.0
"""Parts of a recording that tell the drift, and how far they are sought, s."""

OVERLAP = 0.2
"""Part of the shorter one that both must have."""

RARE = 1e-6
"""Probability that motions which have nothing in common agree as well at some shift."""

ALIKE = 1.02
"""By how much one shift must explain more than any other to be the one."""

LEAST = 0.05
"""Part of what a channel moves by at the shift that shows most of it, which another
shift must show to be believed."""

EXACT, TINY = 1e-6, 1e-12
"""Part of its variance, and m^2/s^4 or rad^2/s^2, that a channel is off by at least."""

FAR_S = 2.0
"""From where on a shift is another one, s."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Channels at even instants.

    Attributes
    ----------
    start : s
    six : (n, 6) less what changes slowly; 0 where there is nothing
    mean : (6,) of the channels as they are
    there : (n,) whether there were samples

    """

    start: float
    six: Array
    mean: Array
    there: Array

    @classmethod
    def of(cls, block: Block) -> Grid:
        """A block at even instants."""
        t = np.arange(block.t[0], block.t[-1], 1 / GRID_HZ)
        out, mean = np.zeros((len(t), 6)), np.zeros(6)
        width = int(SLOW_S * GRID_HZ)
        for c, values in enumerate(block.six.T):
            known = np.isfinite(values)
            if known.sum() < 2:
                continue
            step = float(np.median(np.diff(block.t[known])))
            few = max(int(1 / GRID_HZ / step), 1)
            even = np.interp(t, block.t[known], uniform_filter1d(values[known], few))
            mean[c] = even.mean()
            out[:, c] = even - uniform_filter1d(even, width)
        after = np.clip(np.searchsorted(block.t, t), 1, len(block.t) - 1)
        there = block.t[after] - block.t[after - 1] < 4 / GRID_HZ
        return cls(float(t[0]), out * there[:, None], mean, there.astype(float))


@dataclass(frozen=True, slots=True)
class CommonMotion:
    """What two recordings have in common.

    Attributes
    ----------
    alignment : where they stand beside each other
    hz : (6,) frequency up to which the reference says what each output goes through

    """

    alignment: Alignment
    hz: Array


def aligned(real: Block, sim: Block, names: tuple[str, str]) -> CommonMotion:
    """Find where a recording stands beside a reference, to some hundredths of a second.

    Parameters
    ----------
    real, sim : samples of both, SI, each by its own clock
    names : what errors call them

    Raises
    ------
    InputError
        If they show no common motion.

    """
    one, two = Grid.of(real), Grid.of(sim)
    if not any(_shared(one, two)):
        raise InputError(
            f"{names[0]} and {names[1]} have no moving triad in common: compare"
            " accelerometers with accelerometers or gyroscopes with gyroscopes"
        )
    lags, told = _scores(one, two)
    score = told.sum(axis=1)
    best = int(np.argmax(score))
    if told[best] @ _counting(one, two) < chdtri(3 * told.shape[1], RARE / len(lags)):
        raise InputError(
            f"{names[0]} and {names[1]} show no common motion, or too even a one to"
            " tell: let the simulator follow the motion of this recording"
        )
    away = np.abs(lags - lags[best]) > FAR_S
    if score[best] <= ALIKE * score[away].max(initial=0.0):
        other = lags[away][int(np.argmax(score[away]))]
        raise InputError(
            f"{names[0]} and {names[1]} show a motion that repeats itself: shifted by"
            f" {lags[best]:.1f} s or by {other:.1f} s they agree alike; compare a"
            " recording with some motion that does not repeat"
        )
    delay = lags[best] + one.start - two.start
    at, off = _by_parts(one, two, int(round(lags[best] * GRID_HZ)))
    middle = one.start + (len(one.six) - 1) / 2 / GRID_HZ
    if len(at) >= 3:
        slope, level = np.polyfit(at - middle, off, 1, w=None)
        drift, delay = -slope, level + one.start - two.start
    else:
        drift = 0.0
    x, z = _overlap(one, two, int(round(lags[best] * GRID_HZ)))
    turn = _rotation(one, two, x, z)
    unseen = np.zeros(6)
    upright = turn.T @ one.mean[ACC]
    unseen[int(np.argmax(np.abs(upright)))] = upright[np.argmax(np.abs(upright))]
    unseen[two.six.any(axis=0)] = 0.0
    where = Alignment(float(delay), float(drift), middle, turn, unseen)
    return CommonMotion(
        where, np.repeat([common_hz(x[:, p], z[:, p], GRID_HZ) for p in TRIADS], 3)
    )


def _shared(one: Grid, two: Grid) -> list[bool]:
    """Whether both have something of each triad."""
    return [bool(one.six[:, p].any() and two.six[:, p].any()) for p in TRIADS]


def _scores(one: Grid, two: Grid) -> tuple[Array, Array]:
    """Shifts (l,) s, and how well each explains channels of the reference, (1).

    Those that it has, (l, k): -ln(1 - R^2).
    """
    n, m = len(one.six), len(two.six)
    size = int(2 ** np.ceil(np.log2(n + m)))
    overlap = _correlated(one.there[:, None], two.there[:, None], size)[:, 0, 0]
    scores: list[Array] = []
    for part, shared in zip(TRIADS, _shared(one, two), strict=True):
        if not shared:
            continue
        x, z = one.six[:, part], two.six[:, part]
        seen = np.flatnonzero(z.any(axis=0))
        inverse = np.linalg.pinv(x.T @ x, rcond=1e-9)
        c = _correlated(x, z[:, seen], size)  # (lags, 3, k)
        told = np.einsum("lik,ij,ljk->lk", c, inverse, c)
        own = _correlated(one.there[:, None], z[:, seen] ** 2, size)[:, 0]
        share = np.clip(told / np.maximum(own, LEAST * own.max()), 0.0, 1 - 1e-6)
        scores.append(-np.log1p(-share))
    lags = np.arange(size)
    lags = np.where(lags >= n, lags - size, lags)
    total = np.hstack(scores)
    total[overlap < OVERLAP * min(n, m)] = 0.0
    order = np.argsort(lags)
    return lags[order] / GRID_HZ, total[order]


def _counting(one: Grid, two: Grid) -> Array:
    """How many independent samples each channel of the reference counts as, (k,).

    Where motions have nothing in common, n times its -ln(1 - R^2) is then chi squared
    with three degrees of freedom: n = samples / sum_l r_x(l) r_z(l), with r what each
    correlates with itself (M. Bartlett 1935).
    """
    size = 2 * max(len(one.six), len(two.six))
    out: list[Array] = []
    for part, shared in zip(TRIADS, _shared(one, two), strict=True):
        if not shared:
            continue
        mine, theirs = (_with_itself(g.six[:, part], size) for g in (one, two))
        alike = np.abs(theirs @ mine.T).max(axis=1, initial=1.0)
        out.append(min(len(one.six), len(two.six)) / alike)
    return np.concatenate(out)


def _with_itself(six: Array, size: int) -> Array:
    """Correlation of each channel that moves with itself, by shift, (k, size)."""
    power = np.abs(np.fft.rfft(six[:, six.any(axis=0)], size, axis=0)) ** 2
    out = np.fft.irfft(power, size, axis=0).T
    shares: Array = out / out[:, :1]
    return shares


def _correlated(x: Array, z: Array, size: int) -> Array:
    """Sum over t of x(t) z(t - lag), (size, i, k); negative lags at the end."""
    fx, fz = np.fft.rfft(x, size, axis=0), np.fft.rfft(z, size, axis=0)
    out: Array = np.fft.irfft(fx[:, :, None] * fz.conj()[:, None, :], size, axis=0)
    return out


def _by_parts(one: Grid, two: Grid, lag: int) -> tuple[Array, Array]:
    """Middles of parts of the recording, s, and what the shift is in each, s."""
    near, at, off = int(NEAR_S * GRID_HZ), [], []
    edges = np.linspace(0, len(one.six), PARTS + 1).astype(int)
    for first, end in zip(edges[:-1], edges[1:], strict=True):
        begin, stop = max(first - lag, near), min(end - lag, len(two.six) - near)
        if stop - begin < (end - first) / 2:
            continue
        x = one.six[begin + lag : stop + lag]
        if len(x) < stop - begin or not x.any():
            continue
        score = [
            _explained(x, two.six[begin - k : stop - k]) for k in range(-near, near + 1)
        ]
        best = int(np.argmax(score))
        if 0 < best < len(score) - 1:
            down, top, up = score[best - 1 : best + 2]
            bend = max(2 * top - down - up, 1e-12)
            part = best - near + (up - down) / 2 / bend
            at.append(one.start + (begin + stop + 2 * lag) / 2 / GRID_HZ)
            off.append((lag + part) / GRID_HZ)
    return np.array(at), np.array(off)


def _explained(x: Array, z: Array) -> float:
    """How well one explains the other at no shift, by (1)."""
    total = 0.0
    for part in TRIADS:
        mine, theirs = x[:, part], z[:, part]
        size = (theirs**2).sum(axis=0)
        seen = size > 0
        c = mine.T @ theirs[:, seen]
        inverse = np.linalg.pinv(mine.T @ mine, rcond=1e-9)
        share = np.einsum("ik,ij,jk->k", c, inverse, c) / size[seen]
        total -= float(np.log1p(-np.clip(share, 0.0, 1 - 1e-6)).sum())
    return total


def _overlap(one: Grid, two: Grid, lag: int) -> tuple[Array, Array]:
    """Both at a shift, where there are both, (n, 6) each."""
    begin, stop = max(0, -lag), min(len(two.six), len(one.six) - lag)
    return one.six[begin + lag : stop + lag], two.six[begin:stop]


def _rotation(one: Grid, two: Grid, x: Array, z: Array) -> Array:
    """The turn between the axes of both, (2), of what overlaps of them."""
    b = np.zeros((3, 3))
    for part in TRIADS:
        seen = z[:, part][:, z[:, part].any(axis=0)]
        if not seen.size or not x[:, part].any():
            continue
        rest = x[:, part] - seen @ np.linalg.lstsq(seen, x[:, part], rcond=None)[0]
        weight = 1 / np.maximum(rest.var(axis=0), EXACT * x[:, part].var() + TINY)
        b += weight[:, None] * (x[:, part].T @ z[:, part])
        if part is ACC and z[:, ACC].any(axis=0).all():  # where the force points
            mean = np.outer(one.mean[ACC], two.mean[ACC])
            b += len(x) * weight[:, None] * mean
    left_, _, right = np.linalg.svd(b)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left_ @ right))])
    out: Array = left_ @ sign @ right
    return out
