"""Where outputs change most, against rows into which a jump is put."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import SD, ladder, rows_of

from fieldcal.core.samples import Array
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.change_points import change_points, clear_jumps


def rows(y: Array) -> Rows:
    """Rows of 1 s in one window after another, three of them in each."""
    made = rows_of(ladder(), y)
    span = np.column_stack([made.x.t - 0.5, made.x.t + 0.5])
    return replace(made, span=span)


@pytest.mark.parametrize("channel", [1, 5])
@pytest.mark.parametrize("size", [8.0, -30.0])
def test_a_jump_inside_a_window_is_found(channel: int, size: float) -> None:
    rng = np.random.default_rng(3)
    x = ladder()
    y = SD * rng.standard_normal((len(x), 6)) + 5.0 * x.position[:, None]
    after = 13  # the second row of a window
    y[after:15, channel] += size * SD[channel]
    found = change_points(rows(y))
    assert (x.t[after - 1] + x.t[after]) / 2 in found
    assert len(found) <= 6
    inside = [(x.t[x.position == p].min(), x.t[x.position == p].max())
              for p in np.unique(x.position)]  # fmt: skip
    assert all(any(a < at < b for a, b in inside) for at in found)


def test_means_of_several_rows_show_what_single_ones_hide() -> None:
    """A jump of two sigma amid noise with a single row far off."""
    rng, hits = np.random.default_rng(1), 0
    x = ladder(60)
    for _ in range(20):
        y = SD * rng.standard_normal((len(x), 6))
        y[90:120, 2] += 3.0 * SD[2]
        made = rows_of(x, y)
        alone = np.where(np.arange(6) == 2, made.sd, np.nan)
        span = np.column_stack([x.t - 0.2, x.t + 0.2])
        (at,) = change_points(replace(made, sd=alone, span=span))
        hits += x.t[86] < at < x.t[93]
    assert hits >= 18


def test_without_rows_there_is_none() -> None:
    made = rows(np.zeros((27, 6)))
    nothing = np.zeros((27, 6)) + np.nan
    assert len(change_points(replace(made, sd=nothing))) == 0


@pytest.mark.parametrize("channel", [0, 4])
def test_only_a_jump_is_a_clear_one(channel: int) -> None:
    """What swings by as much is none, nor is what drifts."""
    x = ladder(60)
    y = SD * np.random.default_rng(6).standard_normal((len(x), 6))
    span = np.column_stack([x.t - 0.25, x.t + 0.25])
    row = np.arange(len(x))
    for course in (np.sin(row / 3.0), np.sin(row / 12.0), row / 60.0):
        moved = y + 30 * SD * course[:, None]
        assert clear_jumps(replace(rows_of(x, moved), span=span)) == []
    y[80:120, channel] += 40 * SD[channel]
    (found,) = clear_jumps(replace(rows_of(x, y), span=span))
    assert found in [tuple(span[79]), tuple(span[80])]
