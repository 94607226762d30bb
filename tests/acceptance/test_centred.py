"""Outputs from which somebody took the mean, and outputs that are merely small."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.acceptance.centred import (
    biases_taken_out,
    centred,
    centred_and_rounded,
    tracked,
)
from fieldcal.core.samples import Block
from fieldcal.windows import Average

NOISE, RATE = 5e-4, 100.0
COUNT, HELD = 3000, 30.0
REPEAT, LEAST = 1e-3, 1e-4
BOTH = 0.05, REPEAT
EARTH = 7.292e-5


def at_rest(
    rng: np.random.Generator, bias: float, tracks_s: float = 0.0, earth: float = 0.0
) -> tuple[list[Average], Block]:
    """Six windows of white noise about a bias, with the Earth's rate along an axis.

    Where the device tracks its bias it takes out a running mean over some seconds,
    which a turn before each window has put out.
    """
    gyr = []
    for k in range(6):
        one = bias + NOISE * rng.standard_normal((COUNT, 3))
        one[:, k % 3] += earth * (-1) ** (k // 3)
        keep = np.exp(-1 / RATE / tracks_s) if tracks_s else 0.0
        mean = np.full(3, bias + NOISE)
        for i in range(COUNT if tracks_s else 0):
            mean = keep * mean + (1 - keep) * one[i]
            one[i] -= mean
        gyr.append(one)
    block = Block.of(
        np.arange(6 * COUNT) / RATE, np.zeros((6 * COUNT, 3)), np.concatenate(gyr)
    )
    windows = [
        Average(np.zeros(6), np.eye(6), 21.0, COUNT, HELD * k, HELD * (k + 1))
        for k in range(6)
    ]
    return windows, block


def recording(rng: np.random.Generator, mean: float) -> Block:
    acc = mean + rng.standard_normal((COUNT, 3))
    return Block.of(np.arange(COUNT) / RATE, acc, np.zeros((COUNT, 3)))


def test_a_bias_or_the_earths_rate_stands_out() -> None:
    rng = np.random.default_rng(1)
    for bias, earth in ((1e-3, 0.0), (-1e-4, 0.0), (0.0, EARTH)):
        found = [
            tracked(*at_rest(rng, bias, earth=earth), REPEAT, LEAST)[0]
            for _ in range(20)
        ]
        assert min(found) == 1.0


def test_so_noisy_a_device_may_be_at_zero_by_chance() -> None:
    rng = np.random.default_rng(5)
    windows, block = at_rest(rng, 0.0)
    block.gyr[:] *= 100.0
    assert tracked(windows, block, REPEAT, LEAST)[0] > LEAST


def test_a_bias_that_is_tracked_leaves_nothing() -> None:
    rng = np.random.default_rng(2)
    for seconds in (0.5, 1.0, 3.0):
        windows, block = at_rest(rng, -7e-3, seconds)
        chance, what = tracked(windows, block, REPEAT, LEAST)
        assert chance < LEAST and "18 means" in what
    assert tracked(windows[:1], block, REPEAT, LEAST) == (1.0, "")


def test_a_recording_without_its_mean() -> None:
    rng = np.random.default_rng(3)
    chances = [p for _ in range(200) for _, p in centred(recording(rng, 0.0))]
    assert 0.4 < np.mean(chances) < 0.6 and np.mean(np.array(chances) < 1e-2) < 0.04
    block = recording(rng, 5.0)
    assert all(p == 1.0 for _, p in centred(block))
    block.acc[:] -= block.acc.mean(axis=0)
    assert [name for name, p in centred(block) if p < 1e-9] == ["ax", "ay", "az"]


def test_both_are_told_apart_and_said() -> None:
    rng = np.random.default_rng(4)
    windows, block = at_rest(rng, 1e-3)
    block.acc[:] = 5.0 + rng.standard_normal(block.acc.shape)
    assert biases_taken_out(windows, block, BOTH, LEAST) == []
    block.gyr[:] -= 1e-3
    (said,) = biases_taken_out(windows, block, BOTH, LEAST)
    assert "removes its bias at rest" in said
    block.gyr[:] += 1e-3
    block.acc[:, 1] -= block.acc[:, 1].mean()
    (said,) = biases_taken_out(windows, block, BOTH, LEAST)
    assert "closer to zero in ay than noise" in said


STEP = 5e-3
ROUNDED = {
    "nearest": lambda a: np.round(a / STEP) * STEP,
    "cut": lambda a: np.trunc(a / STEP) * STEP,
    "down": lambda a: np.floor(a / STEP) * STEP,
}


def faces(rng: np.random.Generator, bias: float) -> tuple[list[Average], Block]:
    """Six faces, laid a degree beside where they should be, of unequal length."""
    long = rng.integers(800, 1200, 6)
    up = 9.81 * np.vstack([np.eye(3), -np.eye(3)]) + rng.normal(0, 0.2, (6, 3))
    acc = bias * rng.standard_normal(3) + np.repeat(up, long, axis=0)
    acc += 1e-3 * rng.standard_normal(acc.shape)
    ends = np.concatenate([[0], np.cumsum(long)]) / RATE
    windows = [
        Average(np.zeros(6), np.eye(6), 21.0, 1000, a, b - 0.5 / RATE)
        for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    ]
    t = np.arange(len(acc)) / RATE
    return windows, Block.of(t, acc, np.zeros_like(acc))


@pytest.mark.parametrize("mode", ROUNDED)
def test_a_mean_that_was_taken_before_rounding(mode: str) -> None:
    """What is left of it is the rounding's; a bias of its own stands out of that."""
    rng, found = np.random.default_rng(6), []
    for _ in range(20):
        windows, block = faces(rng, 0.05)
        own = block.acc.copy()
        block.acc[:] = ROUNDED[mode](own)
        assert centred_and_rounded(windows, block, 0.05, LEAST) > LEAST
        block.acc[:] = ROUNDED[mode](own - own.mean(axis=0))
        assert all(p > LEAST for _, p in centred(block))
        found.append(centred_and_rounded(windows, block, 0.05, LEAST))
    assert np.mean(np.array(found) < LEAST) > 0.6
    block.acc[:] += 1e-3 * rng.standard_normal(block.acc.shape)
    assert centred_and_rounded(windows, block, 0.05, LEAST) == 1.0
