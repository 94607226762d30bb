"""Rotations from angular rates: integration on SO(3).

A vector u that is fixed in space obeys, in the axes of a body that turns at w,

    du/dt = -w x u,   u(t) = F(t) u(0),   F = ... E_2 E_1,   E_j = exp(-[q_j x])   (1)

The step from edge a to edge b takes T seconds and contains samples every h seconds:

    m_k = (w_k + w_k+1) / 2 - h_k (w'_k+1 - w'_k) / 12                            (2)
    q_j = sum_k h_k m_k + T^2 (w_a x w_b) / 12                                    (3)

m_k of (2) is the mean rate between samples k and k + 1. If w' is a difference over two
samples, m_k is (13 (w_k + w_k+1) - w_k-1 - w_k+2) / 24 for evenly spaced samples, which
is of fourth order. q_j is the rotation vector of step j, rad; its last term is the
rotation that remains after a cycle of coning. w in rad/s, device axes.
Source: rule of Euler and Maclaurin (2); Magnus 1954, for rates that change evenly
within a step (3); P. G. Savage 1998, for coning.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.derivative import derivative
from fieldcal.core.rotation import cross, rotation_matrices
from fieldcal.core.samples import Array, Index


def small_turns(t: Array, w: Array, edge: Index) -> Array:
    """Rotation vectors q (m, 3), rad, of the steps between the edges, (3).

    `t` (n,) s and `w` (n, 3) rad/s are samples; `edge` (m + 1,) indices of them.
    """
    total = np.add.reduceat(
        (np.diff(t)[:, None] * mean_rates(t, w))[: edge[-1]], edge[:-1], axis=0
    )
    coning = cross(w[edge[:-1]], w[edge[1:]])
    return total + np.diff(t[edge])[:, None] ** 2 / 12 * coning


def mean_rates(t: Array, w: Array) -> Array:
    """Mean of the rate (n, 3) from each sample to the next, (n - 1, 3), (2)."""
    mean: Array = (w[:-1] + w[1:]) / 2
    if len(t) > 2:
        slope = derivative(t, w)
        mean -= np.diff(t)[:, None] * np.diff(slope, axis=0) / 12
    return mean


def attitudes_from_rotations(angle: Array) -> Array:
    """Attitudes F at the edges, (m + 1, 3, 3), the first of them the identity, (1).

    `angle` (m, 3) rad are the rotation vectors of the body in each step. A vector that
    is fixed in space rotates by -`angle` in body axes.

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
