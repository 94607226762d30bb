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


NOISE = 0.02
LEVEL = np.array([0.3, -0.2, 9.8, 0.01, 0.02, -0.03])


def ends_of(beyond: Array, before: int = 0, pause: float = 0.0) -> tuple[str, str]:
    """Reasons of a stretch of 40 cells; each departs by the noise, forth and back.

    `beyond` (k, 6) are cells less the level, behind it or, of `before`, ahead of it.
    """
    sign = np.where(np.arange(40) % 2, 1.0, -1.0)[:, None]
    held = sign * np.repeat([NOISE, NOISE / 100], 3)
    means = np.vstack([beyond[:before], held, beyond[before:]])
    t = 50.0 + 0.1 * np.arange(len(means))
    t[before + 40 :] += pause
    sums = np.zeros((len(means), 34))
    sums[:, :6], sums[:, 6:12] = 5.0, 5.0 * means
    rows = np.column_stack([t, sums])
    spans = [(t[before], t[before + 39] + 0.08)]  # five samples in a cell
    ((begins, ends),) = stretch_end_reasons(rows, LEVEL, spans)
    return begins, ends


def cells_with(count: int, at: int, channel: int, size: float) -> Array:
    beyond = np.zeros((count, 6))
    beyond[at, channel] = size
    return beyond


@pytest.mark.parametrize("side", [0, 1])
def test_a_second_beyond_an_end_is_looked_at(side: int) -> None:
    """Ten cells, from the end on; what comes later is no reason."""
    for distance in range(12):
        at = distance if side else 11 - distance
        beyond = cells_with(12, at, 4, -0.05)
        found = ends_of(beyond, 0 if side else 12)[side]
        cut = "it is cut, for it changes slowly"
        turned = "it is turned: gy reaches 0.05 rad/s"
        assert found == (turned if distance < 10 else cut)
    said = ["the recording begins", "the recording ends"][side]
    for count, reason in ((9, said), (10, "it is cut, for it changes slowly")):
        assert ends_of(np.zeros((count, 6)), 0 if side else count)[side] == reason
    assert ends_of(np.zeros((3, 6)), 3) == (
        "the recording begins",
        "the recording ends",
    )


@pytest.mark.parametrize(
    ("size", "channel", "says"),
    [
        (0.019, 5, "a disturbance: gz by 0.019 rad/s"),
        (-0.021, 5, "it is turned: gz reaches 0.021 rad/s"),
        (-0.082, 1, "a disturbance: ay by 0.082 m/s^2"),
        (0.078, 1, "it is cut, for it changes slowly"),
        (7.9e-4, 3, "it is cut, for it changes slowly"),
        (-8.1e-4, 3, "a disturbance: gx by 0.00081 rad/s"),
    ],
)
def test_a_departure_is_a_turn_or_four_times_the_noise(
    size: float, channel: int, says: str
) -> None:
    assert ends_of(cells_with(12, 4, channel, size))[1] == says
    assert ends_of(cells_with(12, 4, channel, size), 12)[0] == says


@pytest.mark.parametrize(
    ("last", "says"), [(-0.21, "it moves"), (-0.19, "a disturbance")]
)
def test_what_lasts_has_more_than_half_of_its_size_at_the_end(
    last: float, says: str
) -> None:
    """The end of the second, away from the stretch; the largest of all tells it."""
    beyond = np.zeros((10, 6))
    beyond[:, 0], beyond[:, 2] = 0.02, -0.3
    beyond[3, 2], beyond[9, 2], beyond[8, 2] = -0.4, last, 0.0
    assert ends_of(beyond)[1] == f"{says}: az by 0.4 m/s^2"
    assert ends_of(beyond[::-1], 10)[0] == f"{says}: az by 0.4 m/s^2"


def test_a_pause_is_longer_than_a_second_and_what_lies_behind_it_is_no_reason() -> None:
    behind = cells_with(12, 2, 4, 0.5)
    assert ends_of(behind, pause=0.9)[1] == "it is turned: gy reaches 0.5 rad/s"
    assert ends_of(behind, pause=1.2)[1] == "a pause of 1.2 s"
    assert ends_of(behind[:3], pause=1.2)[1] == "a pause of 1.2 s"


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


@pytest.mark.parametrize("last", [False, True])
def test_the_longest_calm_part_is_explained(last: bool) -> None:
    """It creeps in two places, for 16 s and for 8 s, whichever comes first."""
    rng = np.random.default_rng(5)
    acc = [0.0, 0.0, 9.8] + rng.normal(0, 0.01, (1600, 3))
    gyr = rng.normal(0, 1e-3, (1600, 3))
    t = np.arange(1600) / RATE
    first, second = ((4.0, 12.0), (15.0, 31.0)) if last else ((0.0, 16.0), (19.0, 27.0))
    calm = np.zeros(1600, dtype=bool)
    for start, end in (first, second):
        some = (t >= start) & (t < end)
        calm |= some
        acc[some, 0] += 0.2 * (t[some] - start)
    acc[~calm] += rng.normal(0, 2.0, (int((~calm).sum()), 3))
    gyr[~calm] += rng.normal(0, 0.5, (int((~calm).sum()), 3))
    cells = CellAccumulator()
    cells.add(Block.of(t, acc, gyr))
    text = explain_no_stretch(cell_rows(cells.table), cells.table.origin)
    found = text.removeprefix("its calmest part, ").split(" s, ")[0].split(" to ")
    start, end = max((first, second), key=lambda one: one[1] - one[0])
    np.testing.assert_allclose([float(x) for x in found], [start, end], atol=1.1)
