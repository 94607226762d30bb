"""Products of columns at one instability, against the whole matrix of all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gram_cases import TAU, case

from fieldcal.model.evidence.weighted_columns import SplitColumns, WeightedColumns


@pytest.mark.parametrize("free", [(), (1, 3)], ids=["set", "loose"])
@pytest.mark.parametrize("factor", [0.0, 1.0, 30.0])
def test_columns_of_one_window_are_summed_over_it_alone(
    free: tuple[int, ...], factor: float
) -> None:
    """Beside blocks of several windows, of two windows one each, and of none."""
    gram = case(3, free).gram
    means = gram.means.copy()
    for column, window in ((0, 1), (1, 1), (2, 3), (5, 0)):
        others = np.arange(len(means)) != window
        means[others, :, column] = 0.0
    means[:, :, 7] = 0.0
    gram = replace(gram, means=means)
    blocks = [
        np.array([[0, 1], [1, 2], [3, 4], [5, 6]]),
        np.array([[7], [8], [5]]),
        np.array([[1, 0, 7]]),
    ]
    rows = gram.with_instability(factor * TAU)
    columns = WeightedColumns(SplitColumns(gram, blocks), rows)
    for at, found in zip(blocks, columns.blocks, strict=True):
        for block, there in zip(at, found, strict=True):
            np.testing.assert_allclose(there, rows.matrix(block, block), rtol=1e-10)
    some, every = np.array([6, 1, 7]), np.arange(len(gram.rhs))
    beside = columns.beside(some, gram.within.rows(some))
    np.testing.assert_allclose(beside, rows.matrix(some, every), rtol=1e-10)
    np.testing.assert_allclose(columns.rhs, rows.rhs(every), rtol=1e-10)
