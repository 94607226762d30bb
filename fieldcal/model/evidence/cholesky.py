"""Triangular roots of matrices that rounding errors may make indefinite."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import tolerances


def cholesky_root(scaled: Array) -> Array:
    """Lower triangular root of I + S G S, (..., k, k), with no eigenvalue below 1.

    If Cholesky's decomposition fails by rounding, eigenvalues below 1 are set to 1.
    This happens for windows of hours, which determine slow cosines a million times
    better than quick ones.

    >>> cholesky_root(np.array([[1e20, 1e20], [1e20, 1e20]]))[1, 1] >= 1
    np.True_
    """
    try:
        out: Array = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        values, along = np.linalg.eigh(scaled)
        half = along * np.sqrt(np.maximum(values, 1.0))[..., None, :]
        upper = np.linalg.qr(np.swapaxes(half, -1, -2))[1]
        positive = np.sign(np.diagonal(upper, 0, -2, -1))
        out = np.swapaxes(upper, -1, -2) * positive[..., None, :]
    return out


def triangular_inverse(root: Array) -> Array:
    """Inverse of lower triangular matrices, by halves; faster than in general.

    >>> (triangular_inverse(np.tri(200)) @ np.tri(200) == np.eye(200)).all()
    np.True_
    """
    width = root.shape[-1]
    if width <= tolerances.UNDIVIDED_SIZE:
        return np.linalg.inv(root)
    k = width // 2
    out = np.zeros(root.shape)
    out[..., :k, :k] = first = triangular_inverse(root[..., :k, :k])
    out[..., k:, k:] = last = triangular_inverse(root[..., k:, k:])
    out[..., k:, :k] = -last @ (root[..., k:, :k] @ first)
    return out
