"""Where windows and blocks are cut."""

from __future__ import annotations

import numpy as np
import pytest
from still_samples import about, place, samples

from fieldcal.core.samples import Block
from fieldcal.model.rows.window_bounds import (
    block_bounds,
    block_edges,
    interruptions,
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


KNOWN = about(place(1.0, 3.0), place(5.0, 7.0), place(8.0, 9.5))


def without(*gaps: tuple[float, float]) -> Block:
    block = samples(10.0)
    kept = np.ones(len(block), bool)
    for start, end in gaps:
        kept &= (block.t < start) | (block.t > end)
    return Block.of(block.t[kept], block.acc[kept], block.gyr[kept])


def test_a_gap_between_positions_lies_between_the_end_and_the_start_of_them() -> None:
    assert interruptions(samples(10.0), KNOWN) == []
    ((start, end),) = interruptions(without((3.4, 4.2)), KNOWN)
    assert 2.9 < start < 3.4 and 4.2 < end <= 5.0
    assert len(interruptions(without((3.4, 4.2), (7.1, 7.8)), KNOWN)) == 2


def test_what_is_lost_for_a_moment_or_within_a_position_is_no_interruption() -> None:
    assert interruptions(without((3.4, 3.8)), KNOWN) == []
    assert interruptions(without((5.2, 6.4)), KNOWN) == []
    assert interruptions(without((0.0, 0.9), (9.6, 10.0)), KNOWN) == []
    assert interruptions(without((3.4, 4.2)), about()) == []


def test_order_of_the_positions_and_those_without_samples_change_nothing() -> None:
    other = about(
        place(8.0, 9.5), place(100.0, 101.0), place(5.0, 7.0), place(1.0, 3.0)
    )
    block = without((3.4, 4.2))
    assert interruptions(block, other) == interruptions(block, KNOWN)
