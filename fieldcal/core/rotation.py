"""Rotation matrices of rotation vectors."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array


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
