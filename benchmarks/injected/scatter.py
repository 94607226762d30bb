"""How much the means of parts scatter, by restricted maximum likelihood.

Of one output, y = X p + e with the covariance

    V = s^2 (diag(1/n) + a B + b M)

n the samples of each part, B 1 where two parts share a window (what differs from one
placing to the next), M the covariance of a random walk, min(t_i, t_j) / T. s^2, a and b
maximise

    -2 ln L = ln det S + d ln(z' S^-1 z / d),   S = K' (V / s^2) K,   z = K' y

K spans what X leaves free, d its dimension. What is told of s^2 rests on d degrees of
freedom, what is told of a and b on as many as X leaves of the windows' own means.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from benchmarks.injected.parts import Parts
from fieldcal.core.samples import Array

RATIOS = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""Variances tried, in those of the white noise of a part."""

FEWEST = 2
"""Degrees of freedom below which nothing is said of the scatter."""


@dataclass(frozen=True)
class Scatter:
    """How much the means of one output scatter.

    Attributes
    ----------
    cov : (m, m) covariance
    white : (m,) variances that the white noise has of it
    white_dof, other_dof : degrees of freedom that tell it, and the rest

    """

    cov: Array
    white: Array
    white_dof: float
    other_dof: float


def span(design: Array) -> tuple[Array, Array]:
    """Orthonormal bases of what a design reaches and of what it leaves free."""
    size = np.linalg.norm(design, axis=0)
    kept = design[:, size > 0] / size[size > 0]
    u, values, _ = np.linalg.svd(kept, full_matrices=True)
    rank = int((values > 1e-8 * max(values.max(initial=0.0), 1e-300)).sum())
    return u[:, :rank], u[:, rank:]


def scatter(y: Array, design: Array, parts: Parts, noise: float) -> Scatter:
    """Find how an output's means scatter about a design, (m, p).

    Where the design takes up each window's mean, nothing is said of what windows share.

    `noise` is that of a sample, which serves where the design leaves nothing to see it.
    """
    white = np.diag(1 / parts.count)
    _, free = span(design)
    z = free.T @ y
    if len(z) < FEWEST:
        return _told(noise**2, white, white, design, parts)
    best, found = np.inf, _told(noise**2, white, white, design, parts)
    for shape in _shapes(parts, white, free):
        try:
            factor = cho_factor(free.T @ shape @ free, lower=True)
        except LinAlgError:
            continue
        size = float(z @ cho_solve(factor, z)) / len(z)
        if size <= 0:
            continue
        logdet = 2 * float(np.log(np.diag(factor[0])).sum())
        cost = logdet + len(z) * np.log(size)
        if cost < best:
            best, found = cost, _told(size, shape, white, design, parts)
    return found


def _told(
    size: float, shape: Array, white: Array, design: Array, parts: Parts
) -> Scatter:
    """Scatter of that size and shape, with its degrees of freedom."""
    own = len(shape) - np.linalg.matrix_rank(design)
    held = (parts.window[:, None] == np.unique(parts.window)).astype(float)
    free = held.shape[1] - np.linalg.matrix_rank(held.T @ design)
    alone = held.shape[1] == 1 or free <= 0 < own  # what is told within windows
    dof = own if alone else free
    return Scatter(
        size * shape, size * np.diag(white), max(own, 0.5), max(float(dof), 0.5)
    )


def _shapes(parts: Parts, white: Array, free: Array) -> list[Array]:
    """Covariances that are tried, in units of the white noise of a sample."""
    one = float(np.median(1 / parts.count))
    same = (parts.window[:, None] == parts.window[None, :]).astype(float)
    since = parts.t - parts.t.min()
    walk = np.minimum.outer(since, since) / max(float(since.max()), 1e-9)
    shows = float(np.abs(free.T @ same).max()) > 1e-6
    between = RATIOS if shows else (0.0,)
    return [white + one * (a * same + b * walk) for a, b in product(between, RATIOS)]
