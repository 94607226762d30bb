"""Turns from rates: integration on SO(3), and how it depends on the rates.

A vector u that is fixed outside, seen from a body that turns at w, obeys

    du/dt = -w x u,   u(t) = F(t) u(0),   F = ... E_2 E_1,   E_k = exp(-[q_k x])
    q_k = h (13 (w_k + w_k+1) - w_k-1 - w_k+2) / 24 + h^2 (w_k x w_k+1) / 12

in steps h; the second term is what two axes turning in turn (coning) leave after a
cycle. Where steps are unequal, and at the ends, the mean of two rates is taken. A
change dw of the rates turns the result by

    du = u x s,   s = sum_k B_k dw_k h,   B_k = F(end) F(k)^T

w rad/s, device axes. Source: Magnus 1954, to fourth order in h; P. G. Savage 1998, for
coning.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.samples import Array

EVEN = 0.05
"""Largest difference of neighbouring steps, as a share, that counts as none."""


@dataclass(frozen=True, slots=True)
class Turn:
    """What happened between two instants.

    Attributes
    ----------
    whole : (3, 3) F, from components before to components after
    later : (k, 3, 3) B, from each step to the end
    rate : (k, 3) mean rate of each step, rad/s
    step : (k,) s

    """

    whole: Array
    later: Array
    rate: Array
    step: Array


def integrate(t: Array, w: Array) -> Turn:
    """Integrate rates (k + 1, 3) at instants t (k + 1,), s."""
    h = np.diff(t)[:, None]
    rate = _mean_rate(h[:, 0], w)
    angle = h * rate + h**2 / 12 * np.cross(w[:-1], w[1:])
    until = products(exponential(-angle))
    whole = until[-1]
    # to the middle of a step, since that is where its mean rate acts
    half = until @ exponential(angle / 2)
    return Turn(whole, whole @ np.swapaxes(half, -1, -2), rate, h[:, 0])


def _mean_rate(h: Array, w: Array) -> Array:
    """Mean rate of each step, from the cubic through four samples where it fits."""
    mean = (w[:-1] + w[1:]) / 2
    even = np.ptp(np.stack([h[:-2], h[1:-1], h[2:]]), axis=0) < EVEN * h[1:-1]
    cubic = (13 * (w[1:-2] + w[2:-1]) - w[:-3] - w[3:]) / 24
    mean[1:-1] = np.where(even[:, None], cubic, mean[1:-1])
    return np.asarray(mean)


def exponential(angle: Array) -> Array:
    """Rotation matrices exp([angle x]) by Rodrigues' formula, (..., 3) to (..., 3, 3).

    >>> np.round(exponential(np.array([0, 0, np.pi / 2])) @ [1, 0, 0], 12) + 0.0
    array([0., 1., 0.])
    """
    size = np.linalg.norm(angle, axis=-1)[..., None, None]
    x = cross_matrix(angle)
    # sinc(x) = sin(pi x) / (pi x) is exact at 0, where the quotient is not
    first = np.sinc(size / np.pi)
    second = np.sinc(size / 2 / np.pi) ** 2 / 2
    whole: Array = np.eye(3) + first * x + second * (x @ x)
    return whole


def cross_matrix(v: Array) -> Array:
    """Matrices [v x] with [v x] a = v x a, (..., 3) to (..., 3, 3)."""
    x = np.zeros((*v.shape, 3))
    x[..., 2, 1], x[..., 0, 2], x[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return np.asarray(x - np.swapaxes(x, -1, -2))


def products(steps: Array) -> Array:
    """Products E_k ... E_1 of matrices (m, 3, 3), for every k, by doubling."""
    out = steps.copy()
    reach = 1
    while reach < len(out):
        out[reach:] = out[reach:] @ out[:-reach]
        reach *= 2
    return out
