"""How much of a reference a recording explains, at every shift between the two.

With x the outputs of a triad, less what changes slowly, of covariance A, and z_j one
channel of the reference, of variance v_j, the part of z_j that a turned, scaled triad
can make is, at each shift l,

    R_j^2(l) = c_j(l)^T A^-1 c_j(l) / v_j,    c_j(l) = cov(x(t), z_j(t - l))        (1)

however the axes lie, and what z_j says of the shift is -ln(1 - R_j^2). Where motions
have nothing in common, n times that is chi squared with three degrees of freedom, with
as many independent samples as

    n = samples / sum_l r_x(l) r_z(l)                                               (2)

and r what each correlates with itself. Source: multiple correlation; M. Bartlett 1935
for (2).
"""

from __future__ import annotations

import numpy as np

from fieldcal.against.motion.grid import TRIADS, Grid, shared
from fieldcal.core.samples import Array, Index

OVERLAP = 0.2
"""Part of the shorter one that both must have."""

LEAST = 0.05
"""Part of what a channel moves by at the shift that shows most of it, which another
shift must show to be believed."""

WHOLE = 1 - 1e-6
"""Share that counts as all of a channel: rounding leaves no more."""

RANK = 1e-9
"""Part of a triad's largest variance below which an axis is none of its own."""


def scores(one: Grid, two: Grid) -> tuple[Index, Array]:
    """Shifts (l,), in steps, and how well each explains the reference, (1).

    By channels of the reference that move, (l, k): -ln(1 - R^2).
    """
    n, m = len(one), len(two)
    size = int(2 ** np.ceil(np.log2(n + m)))
    there = _correlated(one.there[:, None], two.there[:, None], size)[:, 0, 0]
    told: list[Array] = []
    for triad in shared(one, two):
        x, z = one.six[:, triad], two.six[:, triad]
        z = z[:, z.any(axis=0)]
        own = _correlated(one.there[:, None], z**2, size)[:, 0]
        own = np.maximum(own, LEAST * own.max())
        told.append(_said(x, _correlated(x, z, size), own))
    total = np.hstack(told)
    total[there < OVERLAP * min(n, m)] = 0.0
    lags = np.arange(size)
    lags = np.where(lags >= n, lags - size, lags)
    order = np.argsort(lags)
    return lags[order], total[order]


def score(x: Array, z: Array) -> float:
    """How well outputs explain a reference of the same instants, (n, 6) each, (1)."""
    total = 0.0
    for triad in TRIADS:
        mine, theirs = x[:, triad], z[:, triad]
        theirs = theirs[:, theirs.any(axis=0)]
        own = (theirs**2).sum(axis=0)
        total += float(_said(mine, (mine.T @ theirs)[None], own[None]).sum())
    return total


def _said(x: Array, c: Array, own: Array) -> Array:
    """-ln(1 - R^2) of channels at shifts, (l, k), by (1).

    `x` (n, 3) outputs, `c` (l, 3, k) their products with the channels, `own` (l, k)
    squares of these.
    """
    inverse = np.linalg.pinv(x.T @ x, rcond=RANK)
    made = np.einsum("lik,ij,ljk->lk", c, inverse, c)  # (1)
    said: Array = -np.log1p(-np.clip(made / own, 0.0, WHOLE))
    return said


def _correlated(x: Array, z: Array, size: int) -> Array:
    """Sum over t of x(t) z(t - lag), (size, i, k); negative lags at the end."""
    fx, fz = np.fft.rfft(x, size, axis=0), np.fft.rfft(z, size, axis=0)
    out: Array = np.fft.irfft(fx[:, :, None] * fz.conj()[:, None, :], size, axis=0)
    return out


def independent(one: Grid, two: Grid) -> Array:
    """How many independent samples each channel of the reference counts as, (k,)."""
    size = 2 * max(len(one), len(two))
    out: list[Array] = []
    for triad in shared(one, two):
        mine, theirs = (_with_itself(g.six[:, triad], size) for g in (one, two))
        alike = np.abs(theirs @ mine.T).max(axis=1, initial=1.0)
        out.append(min(len(one), len(two)) / alike)  # (2)
    return np.concatenate(out)


def _with_itself(triad: Array, size: int) -> Array:
    """Correlation of each channel that moves with itself, by shift, (k, size)."""
    moving = triad[:, triad.any(axis=0)]
    power = np.abs(np.fft.rfft(moving, size, axis=0)) ** 2
    out = np.fft.irfft(power, size, axis=0).T
    shares: Array = out / out[:, :1]
    return shares
