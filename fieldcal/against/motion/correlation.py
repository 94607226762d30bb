"""How much of a reference a recording explains, at every shift between the two.

Let x be the high-passed outputs of a triad with covariance A, and z_j one channel of
the reference with variance v_j. The part of the variance of z_j that a rotated and
scaled triad can explain at the shift l is

    R_j^2(l) = c_j(l)^T A^-1 c_j(l) / v_j,    c_j(l) = cov(x(t), z_j(t - l))        (1)

for any orientation of the axes. The score of the shift is -ln(1 - R_j^2). For unrelated
motions, n times the score is chi squared with three degrees of freedom, where the
number of independent samples is

    n = samples / sum_l r_x(l) r_z(l)                                               (2)

with the autocorrelations r. Source: multiple correlation; M. Bartlett 1935 for (2).
"""

from __future__ import annotations

import numpy as np

from fieldcal.against.motion.grid import TRIADS, EvenGrid, moving_triads
from fieldcal.core.samples import Array, Index

OVERLAP = 0.2
"""Least overlap of both recordings, as a part of the shorter one."""

MIN_OVERLAP_POWER = 0.05
"""Least power of a channel within the overlap, as a part of that at the best shift."""

WHOLE = 1 - 1e-6
"""Largest share of a channel that is explained, given rounding."""

RANK = 1e-9
"""Part of a triad's largest variance below which an axis is not independent."""


def lag_scores(one: EvenGrid, two: EvenGrid) -> tuple[Index, Array]:
    """Shifts (l,), in steps, and the score -ln(1 - R^2) of each, (l, k), (1).

    One column for each channel of the reference that moves.
    """
    n, m = len(one), len(two)
    size = int(2 ** np.ceil(np.log2(n + m)))
    there = _cross_correlation(
        one.has_samples[:, None], two.has_samples[:, None], size
    )[:, 0, 0]
    told: list[Array] = []
    for triad in moving_triads(one, two):
        x, z = one.six[:, triad], two.six[:, triad]
        z = z[:, z.any(axis=0)]
        own = _cross_correlation(one.has_samples[:, None], z**2, size)[:, 0]
        own = np.maximum(own, MIN_OVERLAP_POWER * own.max())
        told.append(_explained(x, _cross_correlation(x, z, size), own))
    total = np.hstack(told)
    total[there < OVERLAP * min(n, m)] = 0.0
    lags = np.arange(size)
    lags = np.where(lags >= n, lags - size, lags)
    order = np.argsort(lags)
    return lags[order], total[order]


def explained_score(x: Array, z: Array) -> float:
    """Total score (1) of outputs for a reference at the same instants, (n, 6) each."""
    total = 0.0
    for triad in TRIADS:
        mine, theirs = x[:, triad], z[:, triad]
        theirs = theirs[:, theirs.any(axis=0)]
        own = (theirs**2).sum(axis=0)
        total += float(_explained(mine, (mine.T @ theirs)[None], own[None]).sum())
    return total


def _explained(x: Array, c: Array, own: Array) -> Array:
    """Score -ln(1 - R^2) of channels at shifts, (l, k), by (1).

    `x` (n, 3) outputs, `c` (l, 3, k) their products with the channels, `own` (l, k)
    squares of these.
    """
    inverse = np.linalg.pinv(x.T @ x, rcond=RANK)
    made = np.einsum("lik,ij,ljk->lk", c, inverse, c)  # (1)
    said: Array = -np.log1p(-np.clip(made / own, 0.0, WHOLE))
    return said


def _cross_correlation(x: Array, z: Array, size: int) -> Array:
    """Sum over t of x(t) z(t - lag), (size, i, k); negative lags at the end."""
    fx, fz = np.fft.rfft(x, size, axis=0), np.fft.rfft(z, size, axis=0)
    out: Array = np.fft.irfft(fx[:, :, None] * fz.conj()[:, None, :], size, axis=0)
    return out


def independent_samples(one: EvenGrid, two: EvenGrid) -> Array:
    """Number of independent samples of each channel of the reference, (k,), (2)."""
    size = 2 * max(len(one), len(two))
    out: list[Array] = []
    for triad in moving_triads(one, two):
        mine, theirs = (_autocorrelation(g.six[:, triad], size) for g in (one, two))
        alike = np.abs(theirs @ mine.T).max(axis=1, initial=1.0)
        out.append(min(len(one), len(two)) / alike)  # (2)
    return np.concatenate(out)


def _autocorrelation(triad: Array, size: int) -> Array:
    """Autocorrelation of each channel that moves, by shift, (k, size)."""
    moving = triad[:, triad.any(axis=0)]
    power = np.abs(np.fft.rfft(moving, size, axis=0)) ** 2
    out = np.fft.irfft(power, size, axis=0).T
    shares: Array = out / out[:, :1]
    return shares
