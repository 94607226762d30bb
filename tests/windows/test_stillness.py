"""Coming to rest: turns of every kind, from the first second on."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcal.core.samples import Array, Block
from fieldcal.windows import Stillness
from fieldcal.windows.cells import CellAccumulator

BIAS = np.array([0.01, -0.02, 0.005])


def stream(
    seed: int, legs: list[tuple[float, float]], rate: float = 100.0, level: bool = False
) -> Block:
    """Smooth turns, (seconds, degrees) each, about the horizontal or the vertical."""
    rng = np.random.default_rng(seed)
    angle, speed = np.empty(0), np.empty(0)
    reached = 0.0
    for seconds, degrees in legs:
        u = np.arange(round(seconds * rate)) / (seconds * rate)
        part = reached + np.deg2rad(degrees) * u**2 * (3 - 2 * u)
        angle = np.concatenate([angle, part])
        speed = np.concatenate([speed, np.deg2rad(degrees) * 6 * u * (1 - u) / seconds])
        reached += np.deg2rad(degrees)
    n = len(angle)
    acc, gyr = 0.05 * rng.standard_normal((n, 3)), 0.002 * rng.standard_normal((n, 3))
    tilt = np.zeros(n) if level else angle
    acc += -9.81 * np.column_stack([np.sin(tilt), np.cos(tilt), np.zeros(n)])
    gyr[:, 1 if level else 2] += speed
    return Block.of(np.arange(n) / rate, acc, gyr + BIAS)


def watch(block: Block, piece: float = 0.1) -> list[tuple[float, bool, float | None]]:
    stillness = Stillness()
    seen = []
    edges = np.searchsorted(block.t, np.arange(0, block.t[-1] + piece, piece))
    for first, last in pairwise(edges):
        stillness.add(block[int(first) : int(last)])
        now = float(block.t[min(last, len(block) - 1)])
        seen.append((now, stillness.still, stillness.since))
    return seen


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("legs", "level", "rate"),
    [
        pytest.param(
            legs,
            level,
            rate,
            marks=[] if rate in often else pytest.mark.thorough,
        )
        for legs, level, often in [
            ([(5, 0), (3, 45), (5, 0)], False, [1000.0]),
            ([(5, 0), (4, 2.5), (5, 0)], False, [50.0]),
            ([(4, 60), (5, 0)], False, [50.0]),
            ([(5, 0), (4, 45), (5, 0)], True, [50.0]),
            ([(5, 0), (4, 5), (5, 0)], True, [1000.0]),
        ]
        for rate in (50.0, 100.0, 1000.0)
    ],
)
def test_a_turn_is_seen_and_rest_a_second_after_it(
    legs: list[tuple[float, float]], level: bool, rate: float
) -> None:
    middle, late = 0, []
    turn = next(i for i, (_, degrees) in enumerate(legs) if degrees)
    start = sum(seconds for seconds, _ in legs[:turn])
    end = start + legs[turn][0]
    for seed in range(3):
        seen = watch(stream(seed, legs, rate, level))
        inside = [s for t, s, _ in seen if start + 0.3 * (end - start) < t < end - 0.6]
        middle += sum(inside)
        after = [t - end for t, still, _ in seen if t > end and still]
        late.append(after[0])
        last, still, since = seen[-1]
        assert still and since is not None and end - 0.8 <= since <= end + 0.5
    assert middle == 0, "called still in the middle of a turn"
    assert max(late) <= 1.25


@pytest.mark.statistical
@pytest.mark.thorough
def test_rest_is_known_from_the_first_second_and_holds() -> None:
    moving = 0
    for seed in range(20):
        seen = watch(stream(seed, [(20, 0)]))
        assert any(still for t, still, _ in seen if t < 1.2)
        moving += sum(not still for t, still, _ in seen if t > 1.2)
    assert moving <= 20, "of 3760 looks"


def test_noise_that_grows_for_good_is_rest_again_after_a_while() -> None:
    block = stream(0, [(40, 0)])
    rng = np.random.default_rng(1)
    running = block.t > 10
    block.acc[running] += 0.4 * rng.standard_normal((running.sum(), 3))
    seen = watch(block)
    assert not any(still for t, still, _ in seen if 11 < t < 12)
    assert seen[-1][1]


def test_a_change_of_bias_is_taken_for_rest_after_some_seconds() -> None:
    block = stream(0, [(20, 0)])
    block.gyr[1000:] += 0.03
    seen = watch(block)
    assert not any(still for t, still, _ in seen if 10.3 < t < 12.5)
    assert all(still for t, still, _ in seen if t > 16)


def test_a_device_carried_about_from_the_start_is_not_at_rest() -> None:
    block = stream(0, [(15, 0)])
    t = block.t[:, None]
    hz = np.array([0.5, 0.8, 1.1])
    block.acc[:] += 1.5 * np.sin(2 * np.pi * hz * t)
    block.gyr[:] += 0.5 * np.sin(2 * np.pi * hz * t + 1)
    assert not any(still for _, still, _ in watch(block))


@pytest.mark.statistical
@settings(max_examples=8)
@given(cuts=st.lists(st.integers(0, 1000), max_size=10), seed=st.integers(0, 50))
def test_how_samples_are_cut_into_blocks_does_not_matter(
    cuts: list[int], seed: int
) -> None:
    block = stream(seed, [(3, 0), (3, 20), (4, 0)])
    block.acc[:] = np.round(block.acc / 0.02) * 0.02

    def state(edges: list[int]) -> tuple[float, float | None]:
        stillness = Stillness()
        for first, last in pairwise(edges):
            stillness.add(block[first:last])
        return stillness.meter, stillness.since

    meter, since = state([0, *sorted(cuts), 1000])
    whole, expected = state([0, 1000])
    assert since == expected and meter == pytest.approx(whole, rel=1e-6)


def test_channels_that_are_not_measured_do_not_matter() -> None:
    block = stream(0, [(3, 0), (3, 20), (4, 0)])
    gyr: Array = np.full_like(block.gyr, np.nan)
    seen = watch(Block.of(block.t, block.acc, gyr))
    assert not any(still for t, still, _ in seen if 4.0 < t < 5.5)
    assert seen[-1][1]


def slow(block: Block) -> list[tuple[float, float | None]]:
    """(1) to (4) cell by cell: what is allowed of it, and since when it rests."""
    cells = CellAccumulator()
    cells.add(block)
    table, noises, looks = cells.table, [], []
    rest, since, even = None, None, 0
    limit = np.repeat([0.5, 0.1], 3)
    i = np.arange(8)
    for last in range(7, len(table) - 1):
        y = table.means[last - 7 : last + 1]
        noises.append(np.sqrt(np.mean(np.diff(y, axis=0) ** 2, axis=0) / 2))
        noise = 1.6 * np.quantile(noises[-200:], 0.1, axis=0)
        slope, level = np.polyfit(i, y, 1)
        d = np.sqrt(((y - level - np.outer(i, slope)) ** 2).sum(axis=0) / 6)
        bound = limit if rest is not None else 0.2 * limit
        ratios = [
            d / np.minimum(3.5 * noise, bound),
            8 * abs(slope) / np.minimum(6 * noise, bound),
        ]
        meter = float(np.max(ratios))
        if rest is not None:
            off = abs(y[:, 3:].mean(axis=0) - rest) / (0.006 + 3.5 * noise[3:])
            calm = abs(np.diff(y[:, 3:], axis=0)).max(axis=0) <= 18 * noise[3:]
            even = even + 1 if off.max() > 1 and calm.all() else 0
            if even < 30:
                meter = max(meter, float(off.max()))
        time = table.times[last]
        if meter > 1:
            since = None
        elif since is None:
            since = time - 0.7
        if since is not None and time - since > 1.6:
            rest = y[:, 3:].mean(axis=0)
        looks.append((meter, since))
    return looks


@pytest.mark.parametrize("what", ["turn", "bias", "hand", "loud"])
def test_the_meter_is_the_slow_one_after_every_cell(what: str) -> None:
    block = stream(3, [(5, 0), (3, 20), (8, 0)] if what == "turn" else [(16, 0)])
    if what == "bias":
        block.gyr[800:] += [0.0, 0.04, 0.0]
    if what == "hand":
        block.acc[:] += 0.3 * np.sin(np.arange(1600) / 40)[:, None]
    if what == "loud":
        # for 20 s it is remembered how quiet it was
        block = stream(4, [(45, 0)])
        block.acc[2000:] += 0.6 * np.random.default_rng(4).normal(size=(2500, 3))
    block = block[:-1]
    expected = slow(block)
    stillness, seen = Stillness(), []
    for first in range(0, len(block), 10):
        stillness.add(block[first : first + 10])
        seen.append((stillness.meter, stillness.since, stillness.still))
    assert len(seen) == len(expected) + 8
    assert seen[7] == (np.inf, None, False)
    for (meter, since, still), (allowed, from_) in zip(seen[8:], expected, strict=True):
        assert meter == pytest.approx(allowed, rel=1e-6)
        assert since == from_ or since == pytest.approx(from_)
        assert still == (from_ is not None)


def test_steps_of_the_outputs_that_show_are_noise() -> None:
    block = stream(5, [(10, 0)])
    acc = np.zeros_like(block.acc) + [0.0, -9.75, 0.0]
    acc[::70] += 0.25
    acc[::110] -= 0.25
    stillness = Stillness()
    stillness.add(Block.of(block.t, acc, block.gyr))
    assert stillness.still and stillness.meter < 1
    coarse = acc + 2.0 * (block.t[:, None] > 9.5)
    moved = Stillness()
    moved.add(Block.of(block.t, coarse, block.gyr))
    assert not moved.still


def test_a_device_without_noise_is_not_judged_but_by_what_moves() -> None:
    t = np.arange(1000) / 100
    acc = np.zeros((1000, 3)) + [0.0, -9.81, 0.0]
    stillness = Stillness()
    stillness.add(Block.of(t, acc))
    assert (stillness.meter, stillness.still) == (0.0, True)
    assert stillness.since == pytest.approx(0.0)


def test_a_base_that_sways_is_still_as_long_as_each_output_scatters_little() -> None:
    """By the deviation of the last eight means, whatever their level is."""
    rng = np.random.default_rng(7)
    t = np.arange(200) / 100
    for channel, size, limit in ((1, 0.45, 0.5), (4, 0.12, 0.1)):
        six = np.array([0.3, -9.8, 0.2, 0.02, -0.01, 0.0]) + np.zeros((200, 6))
        six[:, channel] += size * np.sin(2 * np.pi * 1.3 * t) * np.sqrt(2)
        six += 1e-4 * rng.standard_normal(six.shape)
        told = Stillness(sways=True)
        told.add(Block.of(t, six[:, :3], six[:, 3:])[:-1])
        means = six[:190].reshape(19, 10, 6).mean(axis=1)[-8:]
        expected = (means.std(axis=0) / np.repeat([0.5, 0.1], 3)).max()
        assert told.meter == pytest.approx(expected, rel=1e-6)
        assert told.still == (size < limit)
