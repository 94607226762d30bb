"""Coming to rest: turns of every kind, from the first second on."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcal.core.samples import Array, Block
from fieldcal.windows import Stillness

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
@pytest.mark.parametrize("rate", [50.0, 100.0, 1000.0])
@pytest.mark.parametrize(
    ("legs", "level"),
    [
        ([(5, 0), (3, 45), (5, 0)], False),
        ([(5, 0), (4, 2.5), (5, 0)], False),
        ([(4, 60), (5, 0)], False),
        ([(5, 0), (4, 45), (5, 0)], True),
        ([(5, 0), (4, 5), (5, 0)], True),
    ],
)
def test_a_turn_is_seen_and_rest_a_second_after_it(
    legs: list[tuple[float, float]], level: bool, rate: float
) -> None:
    middle, late = 0, []
    turn = next(i for i, (_, degrees) in enumerate(legs) if degrees)
    start = sum(seconds for seconds, _ in legs[:turn])
    end = start + legs[turn][0]
    for seed in range(6):
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
@settings(max_examples=20)
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
