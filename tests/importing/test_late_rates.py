"""Gyroscopes whose times are late are said, by rates that are shifted by rows."""

from __future__ import annotations

import numpy as np
import pytest
from laid_about import turned

from fieldcal.core.samples import Array, Block
from fieldcal.importing.session.late_rates import late_rates
from fieldcal.windows.cells import CellAccumulator
from fieldcal.windows.stretches import cell_rows

ROWS = turned(67, 50.0, 3.0)


def said(rows: Array) -> str:
    cells = CellAccumulator()
    cells.add(Block.of(rows[:, 0], rows[:, 1:4], rows[:, 4:]))
    return late_rates(cell_rows(cells.table))


@pytest.mark.parametrize("late", [-60, -25, 25, 60])
def test_rates_of_another_clock_are_said(late: int) -> None:
    rows = ROWS.copy()
    rows[:, 4:] = np.roll(rows[:, 4:], late, axis=0)
    how = "later" if late > 0 else "earlier"
    assert f"each turn {abs(late) / 50:.1f} s {how} than" in said(rows)


@pytest.mark.parametrize("late", [-2, 0, 2])
def test_a_filter_is_not_said(late: int) -> None:
    rows = ROWS.copy()
    rows[:, 4:] = np.roll(rows[:, 4:], late, axis=0)
    assert said(rows) == ""


def test_nothing_is_said_of_what_does_not_turn_or_has_no_rates() -> None:
    rng = np.random.default_rng(5)
    for seed in range(20):
        still = np.tile(ROWS[:1], (1500, 1)) + rng.normal(0, 0.01, (1500, 7))
        still[:, 0] = np.arange(1500) / 50
        assert said(still) == "", seed
    alone = ROWS.copy()
    alone[:, 4:] = np.nan
    assert said(alone) == ""
    assert said(ROWS[:20]) == ""
