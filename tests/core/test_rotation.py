"""Rotation matrices against rotations built another way, and by their series."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from fieldcal.core.rotation import (
    cross,
    cross_matrix,
    nearest_rotation,
    rotation_matrices,
    rotation_vectors,
)

VECTORS = np.random.default_rng(3).standard_normal((2, 4, 3))


def test_cross_products_are_those_of_numpy_to_the_last_digit() -> None:
    one, row = VECTORS[0, 0], VECTORS[0]
    for a, b in ((VECTORS, VECTORS[::-1]), (one, row), (VECTORS, one), (one, one)):
        np.testing.assert_array_equal(cross(a, b), np.cross(a, b))


def test_the_cross_matrix_is_the_cross_product() -> None:
    others = np.random.default_rng(4).standard_normal((2, 4, 3))
    found = (cross_matrix(VECTORS) @ others[..., None])[..., 0]
    np.testing.assert_allclose(found, np.cross(VECTORS, others), atol=1e-15)
    one = cross_matrix(np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(one, [[0, -3, 2], [3, 0, -1], [-2, 1, 0]])


def test_rotations_are_those_of_their_vectors_however_small() -> None:
    for size in (0.0, 1e-12, 1e-4, 0.3, np.pi, 7.0):
        vectors = size * VECTORS.reshape(-1, 3)
        expected = Rotation.from_rotvec(vectors).as_matrix()
        np.testing.assert_allclose(rotation_matrices(vectors), expected, atol=1e-14)
    one = VECTORS[0, 0]
    np.testing.assert_allclose(
        rotation_matrices(one), expm(cross_matrix(one)), atol=1e-14
    )
    np.testing.assert_array_equal(rotation_matrices(np.zeros(3)), np.eye(3))


def test_rotation_vectors_are_those_of_their_matrices_up_to_half_a_turn() -> None:
    for size in (0.0, 1e-9, 1e-4, 0.3, 3.0, np.pi - 1e-9):
        vectors = VECTORS / np.linalg.norm(VECTORS, axis=-1, keepdims=True) * size
        found = rotation_vectors(rotation_matrices(vectors))
        np.testing.assert_allclose(found, vectors, atol=3e-15 + 1e-7 * (size > 3.1))
    turns = Rotation.random(200, rng=5)
    found = rotation_vectors(turns.as_matrix())
    np.testing.assert_allclose(found, turns.as_rotvec(), atol=1e-12)
    half = np.diag([-1.0, 1.0, -1.0])
    np.testing.assert_allclose(
        np.abs(rotation_vectors(half)), [0.0, np.pi, 0.0], atol=1e-15
    )


def test_the_nearest_rotation_aligns_vectors_and_mirrors_none() -> None:
    rng = np.random.default_rng(6)
    for count in (2, 3, 8):
        x, y = rng.standard_normal((2, count, 3))
        expected = Rotation.align_vectors(y, x)[0].as_matrix()
        np.testing.assert_allclose(nearest_rotation(y.T @ x), expected, atol=1e-9)
    mirrored = nearest_rotation(np.diag([1.0, 2.0, -0.1]))
    np.testing.assert_allclose(mirrored, np.eye(3), atol=1e-12)
