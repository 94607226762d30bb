"""Roots and inverses against the matrices they are of, also where digits are lost."""

import numpy as np
import pytest

from fieldcal.model.evidence.cholesky import cholesky_root, triangular_inverse


@pytest.mark.parametrize("seed", range(20))
def test_a_root_is_one_where_numbers_have_too_few_digits(seed: int) -> None:
    """I + S G S of columns whose sizes differ by many powers of ten."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(5, 20)) * np.exp(rng.normal(0, 12, 20))
    whole = np.eye(20) + rows.T @ rows
    root = cholesky_root(whole)
    assert (np.diag(root) > 0).all() and not np.triu(root, 1).any()
    size = np.sqrt(np.diag(whole))
    again = root @ root.T / np.outer(size, size)
    np.testing.assert_allclose(again, whole / np.outer(size, size), atol=1e-6)


def test_roots_of_several_matrices_are_those_of_each() -> None:
    """Where rounding leaves one of them without a root, too."""
    some = np.random.default_rng(3).standard_normal((2, 90, 80))
    many = np.eye(80) + np.swapaxes(some, 1, 2) @ some
    worst = np.array([many[0], np.full((80, 80), 1e20)])
    roots = cholesky_root(worst)
    np.testing.assert_allclose(roots[0] @ roots[0].T, many[0], rtol=1e-8, atol=1e-8)
    assert np.diag(roots[1]).min() >= 1 - 1e-9 and not np.triu(roots[1], 1).any()
    for one, both in zip(
        cholesky_root(many), triangular_inverse(cholesky_root(many)), strict=True
    ):
        np.testing.assert_allclose(both @ one, np.eye(80), atol=1e-9)
