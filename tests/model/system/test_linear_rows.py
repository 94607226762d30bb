"""Means of windows from whitened rows, beside a loop over windows."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.model.system.linear_rows import LinearRows

WINDOW = np.array([0, 0, 0, 2, 2, 5, 7, 7, 7, 7])
"""Windows of some rows; others had no usable row of this channel."""


@pytest.fixture
def rows() -> LinearRows:
    rng = np.random.default_rng(3)
    weight, design = rng.uniform(1.0, 9.0, len(WINDOW)), rng.normal(size=(10, 4))
    return LinearRows(
        1, np.arange(10), WINDOW, weight, np.arange(4), design, rng.normal(size=10)
    )


def test_windows_and_where_they_start(rows: LinearRows) -> None:
    assert rows.starts.tolist() == [0, 3, 5, 6]
    assert rows.windows.tolist() == [0, 2, 5, 7]


@pytest.mark.parametrize("name", ["design", "white"])
def test_a_mean_is_weighted_with_the_inverse_variances(
    rows: LinearRows, name: str
) -> None:
    white: Array = getattr(rows, name)
    values = (white.T / rows.weight).T
    for i, window in enumerate(rows.windows):
        own = window == WINDOW
        share = rows.weight[own] ** 2
        assert rows.info[i] == pytest.approx(share.sum())
        np.testing.assert_allclose(
            rows.window_means(white)[i],
            np.average(values[own], axis=0, weights=share),
            rtol=1e-12,
        )


def test_courses_are_the_rows_about_the_means_of_their_windows(
    rows: LinearRows,
) -> None:
    """Of single rows, each its window's mean, nothing is left."""
    about = rows.design.copy()
    for i, window in enumerate(rows.windows):
        own = window == WINDOW
        about[own] -= rows.weight[own, None] * rows.means[i]
    np.testing.assert_allclose(rows.courses, about.T @ about, atol=1e-12)
    first = np.isin(np.arange(10), rows.starts)
    assert not rows.select_rows(first).courses.any()
