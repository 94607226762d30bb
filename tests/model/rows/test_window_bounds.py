"""Where windows and blocks are cut."""

from __future__ import annotations

import numpy as np
import pytest
from still_samples import about, place, samples

from fieldcal.model.rows.window_bounds import (
    block_bounds,
    block_edges,
    window_bounds,
)


def test_a_window_is_the_samples_from_its_start_to_before_its_end() -> None:
    block = samples(10.0)
    known = about(place(2.0, 4.0), place(100.0, 101.0), place(5.01, 6.0))
    np.testing.assert_array_equal(window_bounds(block, known), [[0, 100], [500, 500],
                                                        [151, 200]])  # fmt: skip
    late = about({"alpha_deg": 0.0, "beta_deg": 0.0}, place(3.0, 4.0))
    np.testing.assert_array_equal(window_bounds(block, late), [[500, 500], [50, 100]])
    np.testing.assert_array_equal(window_bounds(block, about()), [[0, 500]])


@pytest.mark.parametrize("length", [0.3, 1.4, 5.0, 39.6])
def test_a_short_window_has_a_row_a_second(length: float) -> None:
    found = block_edges(7.0, 7.0 + length, 9)
    even = np.linspace(7.0, 7.0 + length, max(1, round(length)) + 1)
    np.testing.assert_allclose(found, even, rtol=1e-12)


@pytest.mark.parametrize(
    ("windows", "rows"), [(0, 120), (1, 120), (4, 90), (9, 40), (45, 8), (90, 8)]
)
def test_a_long_window_has_so_many_rows_each_longer_by_the_same_ratio(
    windows: int, rows: int
) -> None:
    found = block_edges(3.0, 3.0 + 600.0, windows)
    each = np.diff(found)
    assert len(each) == rows
    assert found[0] == 3.0 and found[-1] == 603.0
    assert each[0] == pytest.approx(1.0)
    ratio = each[1:] / each[:-1]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert ratio[0] > 1.0
    assert len(block_edges(3.0, 3.0 + rows, windows)) == rows + 1
    np.testing.assert_allclose(np.diff(block_edges(3.0, 3.0 + rows, windows)), 1.0)


def test_no_block_spans_what_was_left_out_of_a_window() -> None:
    t = np.arange(30_000) / 50
    gaps = [(100.0, 100.8), (100.9, 103.0), (700.0, 701.0)]
    whole = block_bounds(t, (50, 29_000), 50.0, 1)
    found = block_bounds(t, (50, 29_000), 50.0, 1, gaps)
    inside = np.concatenate([np.arange(a, b) for a, b in found])
    wanted = [
        i for i in range(50, 29_000) if not any(a <= t[i] < b for a, b in gaps[:2])
    ]
    np.testing.assert_array_equal(inside, wanted)
    assert len(whole) + 1 <= len(found) <= len(whole) + 3
