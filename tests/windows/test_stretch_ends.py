"""Why stretches begin and end, as a person would say."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.windows.cells import CellAccumulator
from fieldcal.windows.stretch_ends import stretch_end_reasons
from fieldcal.windows.stretches import cell_rows, explain_no_stretch, still_stretches

RATE = 50.0


def recorded(change: str) -> Block:
    """Two rests of 8 s with something between them."""
    rng = np.random.default_rng(1)
    n = round(18 * RATE)
    t = np.arange(n) / RATE
    acc = [0.0, 0.0, 9.8] + rng.normal(0, 0.01, (n, 3))
    gyr: Array = rng.normal(0, 1e-3, (n, 3))
    between = (t >= 8) & (t < 10)
    if change == "turn":
        gyr[between, 1] += 0.6
        acc[between] += np.linspace(0, 1, between.sum())[:, None] * [5, 0, -2]
        acc[t >= 10] += [5, 0, -2]
    elif change == "push":
        acc[between, 0] += 2 * np.sin(20 * t[between])
    elif change == "pause":
        t = t + np.where(t >= 9, 300.0, 0.0)
    return Block.of(t, acc, gyr)


@pytest.mark.parametrize(
    ("change", "ended"),
    [("turn", "it is turned: gy reaches 0.6 rad/s"), ("pause", "a pause of 300 s"),
     ("push", "ax by")],
)  # fmt: skip
def test_what_ends_a_stretch_is_said(change: str, ended: str) -> None:
    block = recorded(change)
    spans = still_stretches(block)
    assert len(spans) == 2
    cells = CellAccumulator()
    cells.add(block)
    table = cells.table
    (first, second) = stretch_end_reasons(cell_rows(table), table.origin, spans)
    assert first[0] == "the recording begins" and second[1] == "the recording ends"
    assert ended in first[1] and ended in second[0]


def turned_slowly(rate: float) -> Block:
    """A device that never rests: gravity goes round at some rad/s."""
    rng = np.random.default_rng(2)
    t = np.arange(round(30 * RATE)) / RATE
    up = np.column_stack([np.sin(rate * t), 0 * t, np.cos(rate * t)])
    gyr = np.array([0.0, -rate, 0.0]) + rng.normal(0, 1e-3, (len(t), 3))
    return Block.of(t, 9.8 * up + rng.normal(0, 0.01, (len(t), 3)), gyr)


@pytest.mark.parametrize(
    ("block", "says"),
    [(turned_slowly(0.005), "s, creeping on ax"),
     (turned_slowly(1.0)[:80], "less than"),
     (turned_slowly(1.0)[:: round(RATE)][:6], "in 6 tenths of a second, and 20")],
)  # fmt: skip
def test_why_there_is_none_is_said(block: Block, says: str) -> None:
    assert not still_stretches(block)
    cells = CellAccumulator()
    cells.add(block)
    assert says in explain_no_stretch(cell_rows(cells.table), cells.table.origin)


def test_a_coarse_output_that_flips_rests() -> None:
    block = recorded("turn")
    coarse = Block.of(
        block.t, np.round(block.acc / 0.1) * 0.1, np.round(block.gyr / 0.02) * 0.02
    )
    assert len(still_stretches(coarse)) == 2


def test_samples_that_come_slowly_are_no_pauses() -> None:
    """Of half a hertz: two seconds to the next are what is usual there."""
    rng = np.random.default_rng(2)
    t = 2.0 * np.arange(200)
    acc = [0.0, 0.0, 9.8] + rng.normal(0, 0.01, (200, 3))
    gyr = rng.normal(0, 1e-3, (200, 3))
    gyr[90:100, 1] += 0.6
    acc[90:100, 0] += np.linspace(0, 5, 10)
    acc[100:, 0] += 5.0
    cells = CellAccumulator()
    cells.add(Block.of(t, acc, gyr))
    rows, origin = cell_rows(cells.table), cells.table.origin
    for span in ((20.0, 120.0), (40.0, 178.0)):
        ((_, ended),) = stretch_end_reasons(rows, origin, [span])
        assert "pause" not in ended
    assert ended == "it is turned: gy reaches 0.6 rad/s"
