"""Rotation matrices of rotation vectors, and back."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array


def rotation_matrices(angle: Array) -> Array:
    """Rotation matrices exp([angle x]) by Rodrigues' formula, (..., 3) to (..., 3, 3).

    >>> np.round(rotation_matrices(np.array([0, 0, np.pi / 2])) @ [1, 0, 0], 12) + 0.0
    array([0., 1., 0.])
    """
    size = np.linalg.norm(angle, axis=-1)[..., None, None]
    x = cross_matrix(angle)
    # sinc(x) = sin(pi x) / (pi x) is exact at 0, where the quotient is not
    first = np.sinc(size / np.pi)
    second = np.sinc(size / 2 / np.pi) ** 2 / 2
    whole: Array = np.eye(3) + first * x + second * (x @ x)
    return whole


def rotation_vectors(matrix: Array) -> Array:
    """Rotation vectors of rotation matrices, (..., 3, 3) to (..., 3) rad.

    The shortest turn; of two that are half a turn, one. From 4 q q^T of the quaternion
    q, of which the column with the largest diagonal is divided by no small number.
    Source: Shepperd 1978.

    >>> np.round(rotation_vectors(rotation_matrices(np.array([0.1, -3.0, 0.2]))), 12)
    array([ 0.1, -3. ,  0.2])
    """
    square = np.zeros((*matrix.shape[:-2], 4, 4))
    trace = np.trace(matrix, axis1=-2, axis2=-1)
    both = matrix + np.swapaxes(matrix, -1, -2)
    square[..., 1:, 1:] = both + (1 - trace)[..., None, None] * np.eye(3)
    square[..., 0, 0] = 1 + trace
    for i, (j, k) in enumerate(((2, 1), (0, 2), (1, 0))):
        square[..., 0, 1 + i] = matrix[..., j, k] - matrix[..., k, j]
    square[..., 1:, 0] = square[..., 0, 1:]
    largest = np.diagonal(square, 0, -2, -1).argmax(axis=-1)
    q = np.take_along_axis(square, largest[..., None, None], -2)[..., 0, :]
    q *= np.where(q[..., :1] < 0, -1.0, 1.0)
    along = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(along, q[..., :1])
    vector: Array = q[..., 1:] * angle / np.maximum(along, 1e-300)
    return vector


def cross(a: Array, b: Array) -> Array:
    """Cross products a x b along the last axis, (..., 3).

    Those of `np.cross`, whose rearranging of axes takes longer than the products of
    the few vectors of a turn.

    >>> cross(np.array([[1.0, 0, 0], [0, 2, 0]]), np.array([0.0, 1, 0]))
    array([[0., 0., 1.],
           [0., 0., 0.]])
    """
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def cross_matrix(v: Array) -> Array:
    """Matrices [v x] with [v x] a = v x a, (..., 3) to (..., 3, 3)."""
    x = np.zeros((*v.shape, 3))
    x[..., 2, 1], x[..., 0, 2], x[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return np.asarray(x - np.swapaxes(x, -1, -2))


def nearest_rotation(matrix: Array) -> Array:
    """Rotation R that is nearest to a matrix B, (3, 3): it maximises tr(R^T B).

    Of vectors x and y = R x with noise, B = sum y x^T (Wahba's problem).
    """
    left, _, right = np.linalg.svd(matrix)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ sign @ right)
