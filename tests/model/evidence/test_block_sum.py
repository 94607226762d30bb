"""A sum of blocks says what the dense matrix says."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.model.evidence.block_sum import BlockSum


def drawn(seed: int) -> tuple[BlockSum, Array]:
    """Three blocks that overlap, and their sum; one row is in none."""
    rng, size = np.random.default_rng(seed), 9
    dense, blocks = np.zeros((size, size)), []
    for count in (4, 5, 2):
        at = rng.permutation(size - 1)[:count]
        root = rng.standard_normal((count, count))
        blocks.append((at, root @ root.T))
        dense[np.ix_(at, at)] += root @ root.T
    return BlockSum.of(size, blocks), dense


@pytest.mark.parametrize("seed", range(4))
def test_parts_are_those_of_the_dense_matrix(seed: int) -> None:
    """Of rows and columns in any order, also several times, and of none."""
    found, dense = drawn(seed)
    rng = np.random.default_rng(seed)
    for count in (0, 1, 5, 12):
        rows, columns = rng.integers(0, 9, count), rng.integers(0, 9, 7)
        for at in (columns, rows):
            expected = dense[np.ix_(rows, at)]
            np.testing.assert_allclose(found.part(rows, at), expected, atol=1e-14)
        np.testing.assert_allclose(found.rows(rows), dense[rows], atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_blocks_on_the_diagonal_are_those_of_the_dense_matrix(seed: int) -> None:
    found, dense = drawn(seed)
    at = np.random.default_rng(seed).integers(0, 9, (6, 3))
    expected = np.array([dense[np.ix_(one, one)] for one in at])
    np.testing.assert_allclose(found.diagonal_parts(at), expected, atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_some_rows_and_columns_are_one_block(seed: int) -> None:
    found, dense = drawn(seed)
    at = np.array([8, 1, 4, 0])
    some, every = found.select(at), np.arange(4)
    assert len(some.blocks) == 1
    np.testing.assert_allclose(
        some.part(every, every), dense[np.ix_(at, at)], atol=1e-14
    )
    np.testing.assert_allclose(some.rows(every), dense[np.ix_(at, at)], atol=1e-14)
