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
a position that is bad for certain has no weight left. Directions of a position that no
other position checks are left out of its hypothesis: nothing speaks for or against it.
Source: the update formulas of weighted least
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

UNCHECKED = 0.999
"""Leverage of a direction of a position from which no other position checks it."""

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
    rank = basis.shape[-1]
    back = np.swapaxes(basis, -1, -2)
    share, along = np.linalg.eigh(basis @ back)
    checked = share < UNCHECKED
    c = 1 - 1 / WORSE[:, None] ** 2
    gain = 1 / (1 - c * np.where(checked, share, 0.0)[..., None, :])  # (..., n, k, d)
    odd = (np.swapaxes(along, -1, -2) @ residual[..., None])[..., None, :, 0]
    evidence = checked[..., None, :] * (
        c * gain * odd**2 / 2 + np.log(gain) / 2 - np.log(WORSE)[:, None]
    )
    odds = np.log(prior / (1 - prior) / len(WORSE)) + evidence.sum(axis=-1)
    top = np.maximum(odds.max(axis=(-2, -1), keepdims=True), 0.0)
    weight = np.exp(odds - top)
    weight /= np.exp(-top) + weight.sum(axis=(-2, -1), keepdims=True)
    # everything per direction of a position, in the coordinates of its hat matrix
    weigh = weight[..., None] * checked[..., None, :]
    reach = back @ along
    moved = c * gain * odd
    shift = -(reach @ (weigh * moved).sum(axis=-2)[..., None])[..., 0].sum(axis=-2)
    moments = (weight[..., None, None] * _outer(moved * checked[..., None, :])).sum(-3)
    moments[..., range(moments.shape[-1]), range(moments.shape[-1])] += (
        weigh * c * gain
    ).sum(axis=-2)
    added = (reach @ moments @ np.swapaxes(reach, -1, -2)).sum(axis=-3)
    covariance = np.eye(rank) + added - shift[..., :, None] * shift[..., None, :]
    return Doubt(weight.sum(axis=-1), shift, covariance)


def _outer(v: Array) -> Array:
    product: Array = v[..., :, None] * v[..., None, :]
    return product


def certain(found: Doubt, already: Mask) -> Mask:
    """The position of each fit that is newly certain to be bad, (..., n) bool."""
    fresh = np.where(already, 0.0, found.bad)
    worst = fresh == fresh.max(axis=-1, keepdims=True)
    return np.asarray(worst & (fresh > CERTAIN))
