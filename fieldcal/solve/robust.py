"""Doubt about single positions: each may be a bad one, and the answer weighs both.

A window can be disturbed in a way that it does not show itself: the fixture slipped, a
foot leaned on it. So besides "all positions are good" there are the hypotheses
"position i is bad, its means k times as uncertain as stated". With r the weighted
residual of the fit, Q its orthonormal basis, P_i = Q_i Q_i^T, c = 1 - 1/k^2 and
M_i = (I - c P_i)^-1:

    evidence against all good   k^-d |M_i|^1/2 exp(c r_i^T M_i r_i / 2)
    estimate moves by           d_i = -c Q_i^T M_i r_i
    covariance becomes          C_i = I + c Q_i^T M_i Q_i

in the coordinates of Q, d the channels of a position. The answer is the mean over all
hypotheses by their probability, its covariance that of the mixture: the spread between
the hypotheses is in it, so the interval is wide while it is not clear which holds, and
a position that is bad for certain has no weight left. Where the other positions cannot
check one, its hypothesis changes nothing. Source: the update formulas of weighted least
squares (Cook and Weisberg 1982, 2.1) with Bayesian averaging of the mean-shift model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.samples import Array
from fieldcal.solve.linear import Mask

PRIOR = 5e-3
"""Probability, before the data are seen, that a given position is bad."""

WORSE = np.array([4.0, 16.0, 64.0, 1e3, 1e5])
"""How many times the stated uncertainty a bad position may be off, equally probable."""

CERTAIN = 0.99
"""Probability from which a position is taken as bad and loses its weight."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """Mixture over the hypotheses; leading dimensions are those of the fits.

    Attributes
    ----------
    bad : (..., n) probability that a position is bad
    shift : (..., r) move of the estimate, in the coordinates of the basis
    covariance : (..., r, r) of the mixture in these coordinates

    """

    bad: Array
    shift: Array
    covariance: Array


def doubt(basis: Array, residual: Array, prior: float = PRIOR) -> Doubt:
    """Weigh the hypotheses of one bad position.

    Parameters
    ----------
    basis : (..., n, d, r) rows of the orthonormal basis, by position
    residual : (..., n, d) weighted residual
    prior : probability of a position to be bad

    """
    d, rank = basis.shape[-2:]
    hat = basis @ np.swapaxes(basis, -1, -2)
    c = 1 - 1 / WORSE**2
    m = np.linalg.inv(np.eye(d) - c[:, None, None] * hat[..., None, :, :])
    mr = (m @ residual[..., None, :, None])[..., 0]  # (..., n, k, d)
    fall = c * (mr * residual[..., None, :]).sum(axis=-1)
    evidence = fall / 2 + np.linalg.slogdet(m)[1] / 2 - d * np.log(WORSE)
    odds = np.log(prior / (1 - prior) / len(WORSE)) + evidence
    top = np.maximum(odds.max(axis=(-2, -1), keepdims=True), 0.0)
    weight = np.exp(odds - top)
    weight /= np.exp(-top) + weight.sum(axis=(-2, -1), keepdims=True)
    back = np.swapaxes(basis, -1, -2)
    moves = -c[:, None] * (back[..., None, :, :] @ mr[..., None])[..., 0]
    shift = (weight[..., None] * moves).sum(axis=(-3, -2))
    middle = c[:, None, None] * m + c[:, None, None] ** 2 * (
        mr[..., :, None] * mr[..., None, :]
    )
    spread = (weight[..., None, None] * middle).sum(axis=-3)
    added = (back @ spread @ basis).sum(axis=-3)
    covariance = np.eye(rank) + added - shift[..., :, None] * shift[..., None, :]
    return Doubt(weight.sum(axis=-1), shift, covariance)


def certain(found: Doubt, already: Mask) -> Mask:
    """The position of each fit that is newly certain to be bad, (..., n) bool."""
    fresh = np.where(already, 0.0, found.bad)
    worst = fresh == fresh.max(axis=-1, keepdims=True)
    return np.asarray(worst & (fresh > CERTAIN))
