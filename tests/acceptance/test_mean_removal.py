"""Outputs from which somebody took the mean, and outputs that are merely small."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2, norm

from fieldcal.acceptance.bias_cases import BiasSpread
from fieldcal.acceptance.mean_removal import (
    altered_mean_probability,
    mean_probabilities,
    removed_bias_sentences,
    rounded_mean_probability,
)
from fieldcal.core.samples import Array, Block
from fieldcal.windows import Average

NOISE, RATE = 5e-4, 100.0
COUNT, HELD = 3000, 30.0
REPEAT, LEAST = 1e-3, 1e-4
KEEPS = BiasSpread(REPEAT)
BOTH, NONE = (0.05, KEEPS), np.zeros(3)
EARTH = 7.292e-5


def six_windows(gyr: Array) -> tuple[list[Average], Block]:
    """Rates of six windows, one behind the other."""
    block = Block.of(np.arange(len(gyr)) / RATE, np.zeros_like(gyr), gyr)
    return [
        Average(np.zeros(6), np.eye(6), 21.0, COUNT, HELD * k, HELD * (k + 1))
        for k in range(6)
    ], block


def recording(rng: np.random.Generator, mean: float) -> Block:
    acc = mean + rng.standard_normal((COUNT, 3))
    return Block.of(np.arange(COUNT) / RATE, acc, np.zeros((COUNT, 3)))


def test_a_recording_without_its_mean() -> None:
    rng = np.random.default_rng(3)
    chances = [
        p for _ in range(200) for _, p in mean_probabilities(recording(rng, 0.0))
    ]
    assert 0.4 < np.mean(chances) < 0.6 and np.mean(np.array(chances) < 1e-2) < 0.04
    block = recording(rng, 5.0)
    assert all(p == 1.0 for _, p in mean_probabilities(block))
    block.acc[:] -= block.acc.mean(axis=0)
    assert [name for name, p in mean_probabilities(block) if p < 1e-9] == [
        "ax",
        "ay",
        "az",
    ]


def test_both_are_told_apart_and_said() -> None:
    rng = np.random.default_rng(4)
    windows, block = six_windows(1e-3 + NOISE * rng.standard_normal((6 * COUNT, 3)))
    block.acc[:] = 5.0 + rng.standard_normal(block.acc.shape)
    assert removed_bias_sentences(windows, block, BOTH, NONE, LEAST) == []
    followed = replace(block, gyr=lfilter([1, -1], [1, -0.998], block.gyr, axis=0))
    (said,) = removed_bias_sentences(windows, followed, BOTH, NONE, LEAST)
    assert "removes its bias at rest" in said and "about 4 s" in said
    block.acc[:, 1] -= block.acc[:, 1].mean()
    (said,) = removed_bias_sentences(windows, block, BOTH, NONE, LEAST)
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
        block = replace(block, acc=ROUNDED[mode](own))
        assert rounded_mean_probability(windows, block, 0.05, LEAST) > LEAST
        block = replace(block, acc=ROUNDED[mode](own - own.mean(axis=0)))
        assert all(p > LEAST for _, p in mean_probabilities(block))
        found.append(rounded_mean_probability(windows, block, 0.05, LEAST))
    assert np.mean(np.array(found) < LEAST) > 0.6
    block = replace(block, acc=block.acc + 1e-3 * rng.standard_normal(block.acc.shape))
    assert rounded_mean_probability(windows, block, 0.05, LEAST) == 1.0


def near_zero(sigma: Array, spread: float) -> float:
    """Probability that offsets lie within two sigma about zero, by their density."""
    density = float(norm.pdf(0.0, scale=spread))
    return float(np.prod(np.minimum(4 * sigma * density, 1.0)))


@pytest.mark.parametrize("sigmas", [0.1, 0.5, 1.5])
def test_the_chance_of_a_mean_so_small_is_that_of_the_normal(sigmas: float) -> None:
    block = recording(np.random.default_rng(8), 0.0)
    block.acc[:] += sigmas / np.sqrt(COUNT) - block.acc.mean(axis=0)
    expected = float(norm.cdf(sigmas) - norm.cdf(-sigmas))
    for _, p in mean_probabilities(block):
        assert p == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("mode", ROUNDED)
def test_the_chance_of_a_mean_that_rounding_leaves_is_as_written(mode: str) -> None:
    """(4) for six faces, with noise of some steps; x is at zero in four of them."""
    rng, noise, spread = np.random.default_rng(9), 4 * STEP, 0.01
    long = np.array([1000, 700, 900, 1000, 1200, 1100])
    ends = np.concatenate([[0], np.cumsum(long)])
    up = np.repeat(9.81 * np.vstack([np.eye(3), -np.eye(3)]), long, axis=0)
    acc = up + noise * rng.standard_normal(up.shape)
    acc = ROUNDED[mode](acc - acc.mean(axis=0))
    windows = [
        Average(np.zeros(6), np.eye(6), 21.0, 1000, a / RATE, (b - 0.5) / RATE)
        for a, b in pairwise(ends.tolist())
    ]
    part = (long / long.sum())[:, None]
    mean, signs = acc.mean(axis=0), np.sign(acc).mean(axis=0)
    held = np.array([acc[a:b].mean(axis=0) for a, b in pairwise(ends)])
    twice = np.where(np.abs(held) < STEP / 2, 2.0, 1.0)
    assert (twice == 2).sum() >= 1
    each, together = (part * np.ones((6, 3)) * STEP) ** 2, np.full((1, 3), STEP**2)
    chances = []
    for shift, rounding in ((0.0, each), (-0.5, each), (0.0, together),
                            (-signs / 2, each * twice**2)):  # fmt: skip
        var = noise**2 / long.sum() + rounding.sum(axis=0) / 12
        square = float(np.sum((mean - STEP * shift) ** 2 / var))
        if chi2.sf(square, 3) >= LEAST:
            chances.append(chi2.cdf(square, 3) * near_zero(np.sqrt(var), spread))
    expected = 4 * min(chances)
    block = Block.of(np.arange(len(acc)) / RATE, acc, np.zeros_like(acc))
    found = rounded_mean_probability(windows, block, spread, LEAST)
    assert 0 < expected < 1 and found == pytest.approx(expected, rel=0.05)
    large = np.array([1.0, 1.0, 1e3]) * spread  # a bias that is found on one axis
    assert rounded_mean_probability(windows, block, large, LEAST) < 0.02 * found
    acc[5, 1] = np.nan
    assert (
        rounded_mean_probability(windows, replace(block, acc=acc), spread, LEAST) == 1.0
    )
    acc[5, 1] = 0.0
    acc[:, 0] += 1e-3 * rng.standard_normal(len(acc))
    assert (
        rounded_mean_probability(windows, replace(block, acc=acc), spread, LEAST) == 1.0
    )


def test_few_digits_of_what_was_on_a_grid_of_its_own() -> None:
    """Steps of 2.39 thousandths, written in thousandths: never two neighbours."""
    rng = np.random.default_rng(10)
    for _ in range(20):
        windows, block = faces(rng, 0.05)
        own = np.round(block.acc / 2.39e-3) * 2.39e-3
        block = replace(block, acc=np.round(own, 3))
        assert rounded_mean_probability(windows, block, 0.05, LEAST) > LEAST
        block = replace(block, acc=np.round(own - own.mean(axis=0), 3))
        assert rounded_mean_probability(windows, block, 0.05, LEAST) < LEAST


@pytest.mark.parametrize(("step", "shows"), [(1e-3, True), (1e-2, False)])
def test_few_digits_of_what_was_on_the_same_grid_move_all_alike(
    step: float, shows: bool
) -> None:
    """Without their mean all values are off the grid by the same, and so is the mean.

    Two or three thousandths of a step are left by noise; here it is up to a half. Of a
    coarse grid, biases of 0.05 m/s^2 are as close to zero by chance.
    """
    rng, left = np.random.default_rng(11), []
    for _ in range(20):
        windows, block = faces(rng, 0.05)
        own = np.round(block.acc / step) * step
        block = replace(block, acc=own)
        assert rounded_mean_probability(windows, block, 0.05, LEAST) > LEAST
        block = replace(block, acc=np.round((own - own.mean(axis=0)) / step) * step)
        left.append(np.abs(block.acc.mean(axis=0)).max())
        found = rounded_mean_probability(windows, block, 0.05, LEAST)
        assert (found < LEAST) == shows
    assert 0.3 * step < np.median(left) < 0.5 * step


def test_a_mean_that_was_taken_before_something_else() -> None:
    """New samples were drawn on lines between some; of sound ones nothing is refused.

    Beside biases that were there the force has any mean; with all sides held for about
    as long it is next to none, and the mean of all is the bias.
    """
    rng, sound = np.random.default_rng(12), []
    for _ in range(400):
        windows, block = faces(rng, 0.05)
        bias = rng.normal(0, 0.3, 3)
        block.acc[:] += bias - block.acc.mean(axis=0) + rng.normal(0, 0.3, 3)
        sound.append(altered_mean_probability(block, bias))
    for share in (0.01, 0.05):
        assert (np.array(sound) < share).mean() < share + 0.02
    block.acc[:] += 0.1 - block.acc.mean(axis=0)
    assert altered_mean_probability(block, np.full(3, 0.1)) > 0.1
    own = block.acc - block.acc.mean(axis=0)
    for each in (2, 5):
        lines = [np.interp(block.t, block.t[::each], a[::each]) for a in own.T]
        block.acc[:] = np.column_stack(lines)
        assert all(p > LEAST for _, p in mean_probabilities(block))
        assert altered_mean_probability(block, np.array([-2.0, 0.3, 0.05])) < 1e-6
    assert altered_mean_probability(block, NONE) == 1.0
    (said,) = removed_bias_sentences(
        windows, block, BOTH, np.array([2.0, 1.0, 0.1]), LEAST
    )
    assert "subtracted the mean" in said
    block.acc[:, 1] = np.nan
    assert altered_mean_probability(block, np.ones(3)) == 1.0
