"""Still stretches of recordings: made ones, practice sessions and those of others."""

from __future__ import annotations

import gzip
import itertools
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block, concat
from fieldcal.session.folder import Session
from fieldcal.windows import average, still_stretches, stretches
from fieldcal.windows import rests as rest_module
from fieldcal.windows.cells import CellAccumulator
from fieldcal.windows.stretches import calm_parts


def recording(
    seed: int, tremor: float = 0.0
) -> tuple[Block, list[tuple[float, float]]]:
    """Begins in a turn; five rests of 6 s with turns of 2 s between them."""
    rng = np.random.default_rng(seed)
    rate, angle, speed, rests = 100.0, [0.0], [0.0], []
    for k in range(5):
        u = np.arange(200) / 200
        turn = np.deg2rad(35.0 + 10 * k)
        angle += list(angle[-1] + turn * u**2 * (3 - 2 * u))
        speed += list(turn * 6 * u * (1 - u) / 2)
        rests.append((len(angle) / rate, len(angle) / rate + 6))
        angle += [angle[-1]] * 600
        speed += [0.0] * 600
    n, a = len(angle), np.array(angle)
    sway = tremor * np.sin(2 * np.pi * 1.7 * np.arange(n) / rate)
    acc = 9.81 * np.column_stack([np.sin(a + sway), np.zeros(n), np.cos(a + sway)])
    acc += 0.03 * rng.standard_normal((n, 3))
    gyr = 0.002 * rng.standard_normal((n, 3)) + 0.02
    gyr[:, 1] -= np.array(speed) + np.gradient(sway, 1 / rate)
    return Block.of(np.arange(n) / rate, acc, gyr), rests


@pytest.mark.statistical
@pytest.mark.parametrize("tremor", [0.0, 0.001])
def test_rests_are_found_between_the_turns(tremor: float) -> None:
    for seed in range(3):
        block, rests = recording(seed, tremor)
        found = still_stretches(block, 3.0)
        assert len(found) == len(rests)
        for (start, end), (began, ended) in zip(found, rests, strict=True):
            assert began - 0.15 <= start <= began + 1.0
            assert ended - 1.0 <= end <= ended + 0.15
            assert average(block.between(start, end)).n > 300


def test_a_recording_without_a_turn_is_one_stretch() -> None:
    rng = np.random.default_rng(0)
    block = Block.of(
        np.arange(6000) / 100, [0, 0, 9.81] + rng.normal(0, 0.03, (6000, 3))
    )
    ((start, end),) = still_stretches(block)
    assert start < 1.0 and end > 59.0


def test_nothing_still_is_nothing_found() -> None:
    t = np.arange(3000)[:, None] / 100
    rng = np.random.default_rng(0)
    acc = 3 * np.sin(2 * np.pi * np.array([0.4, 0.7, 0.9]) * t)
    block = Block.of(t[:, 0], acc + rng.normal(0, 0.03, acc.shape), acc / 2)
    assert still_stretches(block) == []
    assert still_stretches(block[:5]) == []


@pytest.mark.statistical
@pytest.mark.parametrize(
    "name",
    [
        "p04",
        *(
            pytest.param(name, marks=pytest.mark.thorough)
            for name in ("p01", "p02", "p07", "p09", "p10")
        ),
    ],
)
def test_practice_positions_are_found(shared: Path, name: str) -> None:
    session = Session.open(shared / "practice" / name)
    held = [window for window in session.windows if window]
    found = still_stretches(session.block, 5.0)
    for start, end in held:
        near = [(a, b) for a, b in found if a < end and b > start]
        covered = sum(min(b, end) - max(a, start) for a, b in near)
        assert covered > 0.9 * (end - start), f"{start} to {end} s of {name}"
    for start, end in found:
        inside = session.block.between(start, end)
        seconds = [inside.between(t, t + 1).six for t in np.arange(start, end - 1)]
        level = np.array([part.mean(axis=0) for part in seconds])
        assert np.ptp(level[:, :3], axis=0).max() < 0.06, "a turn got in"


@pytest.mark.parametrize(
    "unit",
    [2, *(pytest.param(unit, marks=pytest.mark.thorough) for unit in (0, 1, 3, 4))],
)
def test_five_hand_turned_units_rest_as_often_as_their_makers_say(
    shared: Path, unit: int
) -> None:
    path = shared / "real" / "mikoff_mpu9150_x5" / f"imu{unit}.log.gz"
    with gzip.open(path, "rt") as log:
        six = np.loadtxt(log)
    block = Block.of(np.arange(len(six)) / 100, six[:, :3], six[:, 3:])
    found = still_stretches(block, 2.0)
    assert 18 <= len(found) <= 20
    for start, end in found:
        part = block.between(start, end)
        assert np.linalg.norm(average(part).mean[:3]) == pytest.approx(9.81, abs=0.5)
        rates = part.gyr - part.gyr.mean(axis=0)
        assert np.abs(rates).max() < 0.25, "a turn got in"


def test_the_faces_of_a_ferraris_session_are_found_and_its_rotations_not(
    shared: Path,
) -> None:
    folder = shared / "real" / "imucal_ferraris"
    rows = json.loads((folder / "example_ferraris_session_list.json").read_text())
    with gzip.open(folder / "example_ferraris_session.csv.gz", "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    acc = np.column_stack([table[f"acc_{a}"] for a in "xyz"])
    gyr = np.deg2rad(np.column_stack([table[f"gyr_{a}"] for a in "xyz"]))
    block = Block.of(np.arange(len(acc)) / 204.8, acc, gyr)
    found = still_stretches(block, 1.5)
    for name, part in rows.items():
        start, end = part["start"] / 204.8, part["end"] / 204.8
        within = sum(max(0.0, min(b, end) - max(a, start)) for a, b in found)
        share = within / (end - start)
        assert share < 0.1 if name.endswith("rot") else share > 0.6, name


def test_the_long_rests_of_a_hand_held_recording_are_found(shared: Path) -> None:
    folder = shared / "real" / "tomisuarez_mpu6050"
    with gzip.open(folder / "example_data_calibration.csv.gz", "rt") as file:
        counts = np.loadtxt(file, delimiter=",", skiprows=5)
    scale = np.repeat([9.81 / 16384, np.deg2rad(1 / 131)], 3)
    six = counts * scale
    block = Block.of(np.arange(len(six)) / 100, six[:, :3], six[:, 3:])
    found = still_stretches(block, 1.0)
    starts, ends = np.loadtxt(folder / "peer_static_intervals.csv", delimiter=",") / 100
    for start, end in zip(starts, ends, strict=True):
        if end - start > 1.5:
            assert any(a < end and b > start for a, b in found), f"{start} to {end} s"


def test_a_real_device_at_rest_is_never_rejected_and_its_means_repeat(
    shared: Path,
) -> None:
    folder = shared / "real" / "tomisuarez_mpu6050"
    with gzip.open(folder / "example_data_tinit_calc.csv.gz", "rt") as file:
        counts = np.loadtxt(file, delimiter=",", skiprows=5)
    six = counts * np.repeat([9.81 / 16384, np.deg2rad(1 / 131)], 3)
    block = Block.of(np.arange(len(six)) / 100, six[:, :3], six[:, 3:])
    windows = [average(block.between(at, at + 30)) for at in range(0, 420, 30)]
    change = np.diff([window.mean for window in windows], axis=0)
    variance = np.array([window.sigma**2 for window in windows])
    pulls = change / np.sqrt(variance[1:] + variance[:-1])
    assert 0.8 < pulls.std() < 1.3


@pytest.fixture(scope="module")
def long() -> Block:
    """Two recordings, one after the other, with values and samples missing."""
    first, second = recording(11)[0], recording(12, 0.001)[0]
    late = Block.of(second.t + first.t[-1] + 0.01, second.acc, second.gyr)
    block = concat([first, late])
    block.acc[300:340, 1] = np.nan
    block.gyr[2400:2500] = np.nan
    kept = np.ones(len(block), dtype=bool)
    kept[1500:1520] = False
    return concat([block[:1500], block[1520:]])


@pytest.mark.parametrize(("part", "sample"), [(40, 1 << 15), (64, 200), (4096, 100)])
def test_a_recording_that_is_looked_at_in_parts_gives_the_same(
    monkeypatch: pytest.MonkeyPatch, long: Block, part: int, sample: int
) -> None:
    expected = still_stretches(long, 3.0)
    assert len(expected) == 10
    monkeypatch.setattr(rest_module, "_PART", part)
    assert still_stretches(long, 3.0) == expected
    monkeypatch.setattr(rest_module, "_SAMPLE", sample)
    found = still_stretches(long, 3.0)
    # what is usual is judged by some of the spans then
    np.testing.assert_allclose(found, expected, atol=0.35)


def test_samples_are_asked_for_where_sums_do_not_do(long: Block) -> None:
    cells = CellAccumulator()
    cells.add(long)
    rows = stretches.cell_rows(cells.table)
    assert rows.shape == (len(cells.table), 35)
    np.testing.assert_array_equal(rows[:, 0], cells.table.times)
    asked = []

    def between(start: float, end: float) -> list[Block]:
        asked.append((start, end))
        # in pieces, some of them empty
        block = long.between(start, end)
        return [block[:0], block[:7], block[7:7], block[7:], block[:0]]

    found = stretches.still_stretches_of_file(rows, cells.table.origin, between, 3.0)
    assert found == still_stretches(long, 3.0)
    assert all(start < end for start, end in asked)


def test_every_stretch_passes_as_a_window_and_is_as_long_as_asked(long: Block) -> None:
    for shortest in (0.0, 3.0, 5.5):
        for start, end in still_stretches(long, shortest):
            assert end - start >= max(1.0, shortest)
            assert average(long.between(start, end)).n > 80
    assert not still_stretches(long, 7.0)
    assert still_stretches(long, -5.0) == still_stretches(long, 1.0)


@pytest.mark.parametrize(("rest_s", "kept"), [(8.0, True), (2.0, False)])
def test_what_lies_after_a_jump_of_an_output_is_kept(rest_s: float, kept: bool) -> None:
    """If it lasts long enough to be tested: a jump is over as soon as it is there."""
    rng, before, rate = np.random.default_rng(5), 8.0, 100
    length = int((before + rest_s) * rate)
    acc = [0, 0, 9.81] + rng.normal(0, 4e-3, (length, 3))
    acc[int(before * rate) :, 2] += 5.5e-3
    found = still_stretches(Block.of(np.arange(length) / rate, acc), 1.0)
    assert found[0][1] == pytest.approx(before, abs=0.15)
    assert len(found) == 1 + kept
    if kept:
        assert found[1][0] == pytest.approx(before, abs=0.3)
        assert found[1][1] == pytest.approx(before + rest_s, abs=0.8)


def test_a_push_cuts_a_rest_in_two() -> None:
    rng = np.random.default_rng(3)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (6000, 3))
    acc[3000:3030, 0] += 0.12
    block = Block.of(np.arange(6000) / 100, acc)
    (_, first), (second, _) = still_stretches(block)
    assert first == pytest.approx(30.0, abs=0.8)
    assert second == pytest.approx(30.3, abs=0.8)


def asking(block: Block, shortest: float) -> tuple[list[tuple[float, float]], int]:
    """Stretches, and how often the samples themselves were asked for."""
    cells, asked = CellAccumulator(), []
    cells.add(block)

    def between(start: float, end: float) -> list[Block]:
        asked.append((start, end))
        part = block.between(start, end)
        return [part[:0], part[:7], part[7:7], part[7:], part[:0]]

    rows = stretches.cell_rows(cells.table)
    found = stretches.still_stretches_of_file(
        rows, cells.table.origin, between, shortest
    )
    assert all(start <= end for start, end in asked)
    return found, len(asked)


def test_where_sums_are_clear_no_samples_are_asked_for() -> None:
    rng = np.random.default_rng(7)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (2000, 3))
    block = Block.of(np.arange(2000) / 100, acc)
    ((start, end),), asked = asking(block, 2.0)
    assert asked == 0 and end - start > 18
    assert start in block.t and np.nextafter(end, 0.0) in block.t
    # of samples that do not lie on the edges of cells it is
    shifted = np.concatenate([[0.0], 0.004 + np.arange(1, 2000) / 100])
    ((first, last),), asked = asking(Block.of(shifted, acc), 2.0)
    assert asked == 1 and last - first == pytest.approx(end - start, abs=0.11)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(s, marks=pytest.mark.thorough) for s in (1, 2))]
)
def test_pushes_that_a_second_does_not_show_cut_a_rest(seed: int) -> None:
    """Each is three times the noise of a cell, for three seconds."""
    rng = np.random.default_rng(seed)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (6000, 3))
    for at in (1500, 4000):
        acc[at : at + 300, 1] += 0.035
    block = Block.of(np.arange(6000) / 100, acc)
    found, asked = asking(block, 2.0)
    assert asked >= 5
    for start, end in found:
        inside = block.between(start, end)
        assert average(inside).n == len(inside)
        assert inside.t[0] == start and inside.t[-1] == np.nextafter(end, 0.0)
    rests = [(0.0, 15.0), (18.0, 40.0), (43.0, 60.0)]
    for start, end in rests:
        covered = sum(max(0.0, min(b, end) - max(a, start)) for a, b in found)
        assert covered > 0.7 * (end - start)
    assert all(a < b for (_, a), (b, _) in itertools.pairwise(found))
    # parts that are shorter than what is asked for are left out
    assert asking(block, 16.0)[0] == [s for s in found if s[1] - s[0] >= 16.0]


@pytest.mark.parametrize("axis", range(3))
def test_even_rotations_are_not_rests(axis: int) -> None:
    """A rate table that turns evenly is as quiet as one that rests."""
    rng = np.random.default_rng(4)
    n = 6000
    rate = np.where(np.arange(n) % 2000 < 800, 0.5, 0.0)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (n, 3))
    gyr = rng.normal(0, 0.002, (n, 3)) + 0.3
    gyr[:, axis] -= rate
    found = still_stretches(Block.of(np.arange(n) / 100, acc, gyr))
    assert len(found) == 3
    for k, (start, end) in enumerate(found):
        assert start == pytest.approx(20 * k + 8, abs=0.8)
        assert end == pytest.approx(20 * k + 20, abs=0.8)


def test_the_longer_of_rest_and_rotation_is_rest_whichever_comes_last() -> None:
    rng = np.random.default_rng(4)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (5000, 3))
    gyr = rng.normal(0, 0.002, (5000, 3))
    gyr[3000:, 2] += 0.5
    ((start, end),) = still_stretches(Block.of(np.arange(5000) / 100, acc, gyr))
    assert start < 1.0 and end == pytest.approx(30.0, abs=0.8)


def test_what_only_the_gyroscopes_tell_is_no_rest() -> None:
    rng = np.random.default_rng(8)
    n = 6000
    acc = [0, 0, 9.81] + rng.normal(0, 0.3, (n, 3))
    gyr = rng.normal(0, 1e-4, (n, 3))
    turning = np.arange(n) % 2000 < 800
    gyr[:, 2] += np.where(turning, 0.01 * np.sin(np.arange(n) / 30), 0.0)
    found = still_stretches(Block.of(np.arange(n) / 100, acc, gyr))
    assert len(found) == 3
    for k, (start, end) in enumerate(found):
        assert start == pytest.approx(20 * k + 8, abs=0.8)
        assert end == pytest.approx(20 * k + 20, abs=0.8)


def test_half_a_second_is_left_at_each_end() -> None:
    rng = np.random.default_rng(7)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (2000, 3))
    block = Block.of(np.arange(2000) / 100, acc)
    assert still_stretches(block) == [(0.5, np.nextafter(19.49, 20.0))]
    shifted = np.concatenate([[0.0], 0.004 + np.arange(1, 2000) / 100])
    ((start, end),) = still_stretches(Block.of(shifted, acc))
    assert (start, end) == (shifted[50], np.nextafter(shifted[1949], 20.0))


def test_rests_whose_samples_are_asked_for_are_all_found() -> None:
    block, rests = recording(9)
    shifted = np.concatenate([[0.0], 0.004 + block.t[1:]])
    late = Block.of(shifted, block.acc, block.gyr)
    found = still_stretches(late, 3.0)
    assert len(found) == len(rests) == 5
    np.testing.assert_allclose(found, still_stretches(block, 3.0), atol=0.15)


def test_a_rest_of_hours_is_one_stretch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rest_module, "_LONGEST", 100)
    monkeypatch.setattr(rest_module, "_PART", 64)
    rng = np.random.default_rng(5)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (4000, 3))
    ((start, end),) = still_stretches(Block.of(np.arange(4000) / 100, acc))
    assert (start, end) == (0.5, np.nextafter(39.49, 40.0))
    # a step is where one stretch ends, wherever the parts of it are
    for at in (1700, 2040, 2055):
        stepped = acc + np.where(np.arange(4000)[:, None] < at, 0.0, [0.3, 0, 0])
        found = still_stretches(Block.of(np.arange(4000) / 100, stepped))
        assert any(abs(end - at / 100) < 1.1 for _, end in found)
        assert not any(start < at / 100 - 0.1 < end - 0.2 for start, end in found)


@pytest.mark.thorough
def test_a_device_that_warms_up_for_hours_is_at_rest_all_the_time() -> None:
    rng = np.random.default_rng(11)
    t = np.arange(72_000) / 10
    acc = [0, 0, 9.81] + rng.normal(0, 0.005, (len(t), 3))
    acc[:, 0] += 0.02 * np.exp(-t / 900)
    gyr = rng.normal(0, 0.001, (len(t), 3)) + 0.001 * np.exp(-t / 900)[:, None]
    ((start, end),) = still_stretches(Block.of(t, acc, gyr))
    assert start < 1.0 and end > t[-1] - 1.0


def test_stretches_begin_at_a_sample_and_end_behind_one(long: Block) -> None:
    for start, end in still_stretches(long, 3.0):
        inside = long.between(start, end)
        assert inside.t[0] == start and inside.t[-1] == np.nextafter(end, 0.0)


@pytest.mark.parametrize("rest_s", [1.5, 1.8])
def test_rests_that_are_all_short_are_found_without_the_turns(rest_s: float) -> None:
    rng = np.random.default_rng(8)
    rest, turn = int(100 * rest_s), 100
    ways = rng.normal(0, 1, (13, 3))
    ways *= 9.81 / np.linalg.norm(ways, axis=1)[:, None]
    done = (1 - np.cos(np.pi * (np.arange(turn) + 0.5) / turn))[:, None] / 2
    acc = np.concatenate(
        [np.r_[np.tile(a, (rest, 1)), a + done * (b - a)] for a, b in pairwise(ways)]
    )
    held = np.arange(len(acc)) % (rest + turn) < rest
    acc += rng.normal(0, 0.02, acc.shape)
    gyr = rng.normal(0, 0.002, acc.shape) + 0.5 * ~held[:, None]
    found = still_stretches(Block.of(np.arange(len(acc)) / 100, acc, gyr), 1.0)
    assert len(found) >= 11
    for start, end in found:
        inside = held[round(100 * start) : round(100 * end)]
        assert len(inside) >= 100 and inside.all()


def test_fewer_than_two_seconds_are_no_recording() -> None:
    rng = np.random.default_rng(6)
    acc = [0, 0, 9.81] + rng.normal(0, 0.03, (360, 3))
    block = Block.of(np.arange(360) / 100, acc)
    assert still_stretches(block[:190], 1.0) == []
    ((start, end),) = still_stretches(block[:250], 1.0)
    assert start < 0.6 and end > 1.8
    # two seconds unless something else is asked for; half a second is lost at the ends
    assert len(still_stretches(block)) == len(still_stretches(block, 3.0)) + 1


def test_a_stretch_holds_as_many_samples_as_a_mean_takes() -> None:
    """In a log of rare rows, a few of them last seconds."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        acc = [0, 0, 9.81] + rng.normal(0, 0.02, (24, 3))
        acc[:8] += rng.normal(0, 0.1, (8, 3))
        t = np.cumsum(rng.choice([0.75, 3.4], 24, p=[0.65, 0.35]))
        block = Block.of(t, acc, rng.normal(0, 1e-3, (24, 3)))
        for start, end in still_stretches(block, 1.0):
            assert average(block.between(start, end)).n >= 10


def test_a_device_of_which_nothing_ever_varies_is_at_rest_or_stuck() -> None:
    block = Block.of(np.arange(2000) / 100, np.zeros((2000, 3)) + [0, 0, 9.81])
    for start, end in still_stretches(block):
        assert end - start > 15


def test_only_what_goes_on_is_joined_at_a_seam() -> None:
    """A rest that another follows at once, after a jerk, is one of its own."""
    parts: list[list[tuple[float, float]]] = [
        [(0.0, 9.9)], [(10.0, 12.0), (15.0, 20.0)], [(20.1, 30.0)], [], [(31.0, 40.0)],
    ]  # fmt: skip
    joined = stretches._join_at_seams(parts, [False, True, False, True, True])
    assert joined == [(0.0, 12.0), (15.0, 20.0), (20.1, 30.0), (31.0, 40.0)]
    assert stretches._join_at_seams([[], [(1.0, 2.0)]], [False, True]) == [(1.0, 2.0)]


@pytest.mark.parametrize("seed", range(3))
def test_a_nudge_amid_a_rest_leaves_both_levels_and_a_drift_leaves_none(
    seed: int,
) -> None:
    t = np.arange(200) / 20
    noise = np.random.default_rng(seed).normal(0, 0.01, (len(t), 3))

    def parts(change: Array) -> list[tuple[float, float]]:
        acc = noise + np.column_stack([0 * t, 0 * t, 9.8 + change])
        block = Block.of(t, acc)
        return calm_parts(lambda a, b: [block.between(a, b)], (0.0, float(t[-1])), 1.0)

    (_, ended), (began, _) = parts(0.2 * (t > 4))
    assert 3.5 < ended <= 4.15 and 4.0 <= began < 4.5
    # what settles is at rest once it has settled; what creeps on is so nowhere
    assert parts(0.4 * np.exp(-t / 1.5))[-1][0] < 5.0
    assert parts(0.03 * t) == [(0.0, t[-1])]
