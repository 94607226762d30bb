"""Rotations from rates: integration on SO(3), and its derivative by the rates.

A vector u that is fixed in space obeys, in the axes of a body that turns at w,

    du/dt = -w x u,   u(t) = F(t) u(0),   F = ... E_2 E_1,   E_j = exp(-[q_j x])   (1)

in steps of T seconds from edge a to edge b, which contain samples every h seconds:

    m_k = (w_k + w_k+1) / 2 - h_k (w'_k+1 - w'_k) / 12                            (2)
    q_j = sum_k h_k m_k + T^2 (w_a x w_b) / 12                                    (3)

(2) is the mean rate between two samples. With w' from differences over two steps it is
(13 (w_k + w_k+1) - w_k-1 - w_k+2) / 24 for even steps, of fourth order. The last term
of (3) is the rotation that remains after a cycle of coning. w rad/s, device axes.
Source: rule of Euler and Maclaurin (2); Magnus 1954, for rates that change evenly
within a step (3); P. G. Savage 1998, for coning.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.derivative import derivative
from fieldcal.core.rotation import rotation_matrices
from fieldcal.core.samples import Array


def small_turns(t: Array, w: Array, edge: NDArray[np.intp]) -> Array:
    """Small turns q (m, 3), rad, between edges (m + 1,), samples of a turn, (3)."""
    total = np.add.reduceat(
        (np.diff(t)[:, None] * mean_rates(t, w))[: edge[-1]], edge[:-1], axis=0
    )
    coning = np.cross(w[edge[:-1]], w[edge[1:]])
    turns: Array = total + np.diff(t[edge])[:, None] ** 2 / 12 * coning
    return turns


def mean_rates(t: Array, w: Array) -> Array:
    """Mean of the rate (n, 3) from each sample to the next, (n - 1, 3), (2)."""
    mean: Array = (w[:-1] + w[1:]) / 2
    if len(t) > 2:
        slope = derivative(t, w)
        mean -= np.diff(t)[:, None] * np.diff(slope, axis=0) / 12
    return mean


def attitudes_from_rotations(angle: Array) -> Array:
    """Attitudes from small turns, (m + 1, 3, 3), the first of them identity, (1).

    `angle` is (m, 3) rad; the turn of a body by it turns vectors seen in it back.

    >>> quarter = attitudes_from_rotations(np.full((90, 3), [0.0, 0.0, np.pi / 180]))
    >>> np.round(quarter[-1] @ [1.0, 0.0, 0.0], 6) + 0.0
    array([ 0., -1.,  0.])
    """
    return np.concatenate([np.eye(3)[None], products(rotation_matrices(-angle))])


def products(steps: Array) -> Array:
    """Products E_k ... E_1 of matrices (m, 3, 3), for every k, by doubling."""
    out = steps.copy()
    reach = 1
    while reach < len(out):
        out[reach:] = out[reach:] @ out[:-reach]
        reach *= 2
    return out
