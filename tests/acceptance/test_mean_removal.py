"""Outputs from which somebody took the mean, and outputs that are merely small."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal, norm

from fieldcal.acceptance.bias_removal import (
    DOUBT,
    POSITION_DEPENDENCE,
    TRACKING,
    BiasSpread,
    bias_removal_probability,
)
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
            bias_removal_probability(*at_rest(rng, bias, earth=earth), KEEPS, LEAST)[0]
            for _ in range(6)
        ]
        assert max(found) <= DOUBT


def test_so_noisy_a_device_may_be_at_zero_by_chance() -> None:
    rng = np.random.default_rng(5)
    windows, block = at_rest(rng, 0.0)
    block.gyr[:] *= 100.0
    assert bias_removal_probability(windows, block, KEEPS, LEAST)[0] < DOUBT


def test_a_bias_that_is_tracked_leaves_nothing() -> None:
    rng = np.random.default_rng(2)
    for seconds in (0.5, 1.0, 3.0, 6.0):
        windows, block = at_rest(rng, -7e-3, seconds)
        chance, what = bias_removal_probability(windows, block, KEEPS, LEAST)
        assert chance > 0.5 and "18 means" in what
    assert bias_removal_probability(windows[:1], block, KEEPS, LEAST) == (0.0, "")


@pytest.mark.parametrize("each", [pytest.param(2, marks=pytest.mark.thorough), 6])
def test_what_is_tracked_is_seen_behind_lines_between_samples(each: int) -> None:
    """A program that drew them left less noise than means have; a bias stays one."""
    rng, found = np.random.default_rng(14), []
    for bias in (0.0, 2e-3):
        for _ in range(5):
            windows, block = at_rest(rng, bias)
            lines = [
                np.interp(block.t, block.t[::each], w[::each]) for w in block.gyr.T
            ]
            block.gyr[:] = np.column_stack(lines)
            found.append(bias_removal_probability(windows, block, KEEPS, LEAST)[0])
    assert min(found[:5]) > DOUBT > 1e-3 > max(found[5:])


def zeroed_at_rest(
    rng: np.random.Generator, bias: float, seconds: float
) -> tuple[list[Average], Block]:
    """The same where a device takes out the mean of its first seconds in each window.

    Before, it takes out what it found in the window before.
    """
    windows, block = at_rest(rng, bias, earth=EARTH)
    count, before = round(seconds * RATE), np.full(3, bias)
    for k in range(6):
        one = block.gyr[k * COUNT : (k + 1) * COUNT]
        found = one[:count].mean(axis=0)
        one[:count] -= before
        one[count:] -= found
        before = found
    return windows, block


@pytest.mark.parametrize("seconds", [0.8, 1.3, 3.0])
def test_a_bias_that_is_taken_out_at_each_stop_leaves_noise(seconds: float) -> None:
    """Its means scatter by more than those of white noise, and are about zero."""
    rng = np.random.default_rng(4)
    for _ in range(3):
        windows, block = zeroed_at_rest(rng, -7e-3, seconds)
        chance, what = bias_removal_probability(windows, block, KEEPS, LEAST)
        assert chance > 0.5 and "18 means" in what


def averaged_once(
    rng: np.random.Generator, seconds: float
) -> tuple[list[Average], Block]:
    """Of an autopilot that averaged its gyroscopes before the first window, once."""
    windows, block = at_rest(rng, 0.0, earth=EARTH)
    block.gyr[:] -= NOISE / np.sqrt(RATE * seconds) * rng.standard_normal(3)
    return windows, block


@pytest.mark.thorough
def test_an_autopilot_that_averaged_once_keeps_its_bias() -> None:
    """Where it tells the offset; one that tracks its bias all the time has none.

    One that takes it out at each stop may look like one that averaged once and feels
    by how it lies: what is installed stays the same then.
    """
    rng = np.random.default_rng(14)
    told: list[bool] = []
    unknown: list[bool] = []
    tracking: list[bool] = []
    for _ in range(40):
        windows, block = averaged_once(rng, rng.uniform(1.0, 4.0))
        block.gyr[:] += 1e-3 * rng.standard_normal(block.gyr.shape)
        for found, averaged in ((told, True), (unknown, False)):
            keeps = BiasSpread(REPEAT, averaged)
            found.append(
                bool(bias_removal_probability(windows, block, keeps, LEAST)[0] > DOUBT)
            )
        windows, block = at_rest(rng, -7e-3, 3.0)
        keeps = BiasSpread(REPEAT, averaged=True)
        tracking.append(
            bool(bias_removal_probability(windows, block, keeps, LEAST)[0] > DOUBT)
        )
    assert sum(told) <= 2
    assert sum(unknown) > 10  # without that they cannot be told apart
    assert np.mean(tracking) > 0.9


def test_windows_too_short_or_too_coarse_show_no_stop() -> None:
    """Of 0.2 s, or of samples so rare that the first mean is of more than a second."""
    rng = np.random.default_rng(6)
    windows, block = at_rest(rng, -7e-3, 1.0)
    short = [replace(w, end=w.start + 0.2) for w in windows]
    slow = Block.of(block.t * 50, block.acc, block.gyr)
    long = [replace(w, start=50 * w.start, end=50 * w.end) for w in windows]
    for some, recorded in ((short, block), (long, slow)):
        assert 0 <= bias_removal_probability(some, recorded, KEEPS, LEAST)[0] <= 1


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
    windows, block = at_rest(rng, 1e-3)
    block.acc[:] = 5.0 + rng.standard_normal(block.acc.shape)
    assert removed_bias_sentences(windows, block, BOTH, NONE, LEAST) == []
    block.gyr[:] -= 1e-3
    (said,) = removed_bias_sentences(windows, block, BOTH, NONE, LEAST)
    assert "removes its bias at rest" in said
    block.gyr[:] += 1e-3
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


def sphere(mean: Array, sigma: float, rng: np.random.Generator) -> float:
    """Density of a mean beside the Earth's rate in an unknown direction, by draws."""
    way = rng.standard_normal((40_000, 3))
    rate = EARTH * way / np.linalg.norm(way, axis=1)[:, None]
    return float(norm.pdf(mean - rate, scale=sigma).prod(axis=1).mean())


@pytest.mark.parametrize("seed", range(3))
def test_the_odds_of_gyroscopes_at_zero_are_those_of_two_normal_laws(seed: int) -> None:
    """Against dense covariances, for means that settle within a window."""
    windows, block = at_rest(np.random.default_rng(seed), 0.0)
    block.gyr[:] *= 4.0
    noise, t = 4.0 * NOISE, np.arange(COUNT) / RATE
    found = []
    for lag in np.geomspace(0.25, 16.0, 100):
        design = np.column_stack([np.ones(COUNT), np.exp(-t / lag)])
        fit, left, *_ = np.linalg.lstsq(design, np.hstack(np.split(block.gyr, 6)))
        sigma = noise * np.sqrt(np.linalg.inv(design.T @ design)[0, 0])
        found.append((left.sum(), fit[0].reshape(6, 3), sigma))
    _, settled, sigma = min(found, key=lambda one: one[0])
    spread = 1e-4
    zero, ways = sigma**2 * np.eye(6), []
    likely = np.prod([multivariate_normal(cov=zero).pdf(axis) for axis in settled.T])
    for leaning in POSITION_DEPENDENCE:
        felt = (EARTH**2 / 3 if leaning else 0.0) + (leaning * spread) ** 2
        cov = zero + felt * np.eye(6) + spread**2 * np.ones((6, 6))
        ways.append(np.prod([multivariate_normal(cov=cov).pdf(a) for a in settled.T]))
    alone = [sphere(c, sigma, np.random.default_rng(9)) for c in settled]
    ways.append(np.prod(alone))
    expected = TRACKING / (TRACKING + np.mean(ways) / likely)
    chance, _ = bias_removal_probability(windows, block, BiasSpread(spread), LEAST)
    assert 1e-4 < expected < 0.999
    assert chance == pytest.approx(expected, rel=0.15, abs=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("count", [100, 300])
def test_of_gyroscopes_with_biases_hardly_any_are_taken_for_such_a_device(
    count: int,
) -> None:
    rng = np.random.default_rng(12)
    taken = 0
    for _ in range(count):
        windows, block = at_rest(rng, 0.0)
        block.gyr[:] *= rng.choice([1.0, 4.0, 16.0])
        block.gyr[:] += REPEAT * rng.standard_normal(3)
        lying = POSITION_DEPENDENCE[-1] * REPEAT * rng.standard_normal((6, 3))
        block.gyr[:] += np.repeat(lying, COUNT, axis=0)
        taken += bias_removal_probability(windows, block, KEEPS, LEAST)[0] > DOUBT
    assert taken <= 0.01 * count


@pytest.mark.parametrize("seed", range(4))
def test_a_bias_that_is_tracked_slowly_leaves_means_about_zero(seed: int) -> None:
    """Each turn puts something into what is subtracted, which stays for a minute.

    Gyroscopes that keep a bias scatter as much, where they feel the force, about it.
    """
    rng, told = np.random.default_rng(seed), []
    scatter = np.repeat(rng.normal(0.0, 6e-5, (6, 3)), COUNT, axis=0)
    for bias in (0.0, REPEAT * rng.standard_normal(3)):
        windows, block = at_rest(rng, 0.0)
        block.gyr[:] += bias + scatter
        told.append(bias_removal_probability(windows, block, KEEPS, LEAST)[0])
    assert told[0] > DOUBT > 0.01 > told[1]


def all_zero(biased: int = 0) -> tuple[list[Average], Block]:
    """Six windows of zeros; the first axes have noise about a bias instead."""
    windows, block = at_rest(np.random.default_rng(21), 1e-3)
    block.gyr[:, biased:] = 0.0
    return windows, block


def test_zeros_at_rest_count_by_the_biases_that_turns_show() -> None:
    """Behind a coarse step all of them are zero; the bias in the turns tells."""
    windows, block = all_zero()
    bias, sigma = np.array([3e-4, -1e-4, 0.0]), np.array([2e-4, 3e-4, 2e-4])
    ratio = np.prod(
        norm.pdf(bias, scale=sigma) / norm.pdf(bias, scale=np.hypot(sigma, REPEAT))
    )
    expected = TRACKING * ratio / (1 + TRACKING * ratio)
    seen = bias, sigma
    chance, what = bias_removal_probability(windows, block, KEEPS, LEAST, seen)
    assert DOUBT < chance == pytest.approx(expected) and "all samples are zero" in what
    for other in (bias + [2e-3, 0.0, 0.0], np.full(3, np.nan)):
        found = bias_removal_probability(windows, block, KEEPS, LEAST, (other, sigma))
        assert found[0] <= TRACKING
    averaged = BiasSpread(REPEAT, averaged=True)
    odds = TRACKING * ratio / ((ratio + 1) / 2)
    found = bias_removal_probability(windows, block, averaged, LEAST, seen)
    assert found[0] == pytest.approx(odds / (1 + odds))


def test_an_axis_with_a_bias_beside_axes_of_zeros_keeps_it() -> None:
    sigma = np.full(3, 1e-5)
    for biased, keeps in ((0, False), (1, True)):
        windows, block = all_zero(biased)
        seen = block.gyr.mean(axis=0), sigma
        chance, _ = bias_removal_probability(windows, block, KEEPS, LEAST, seen)
        assert (chance < 0.01) == keeps
    windows, block = at_rest(np.random.default_rng(22), 0.0)  # noise about zero
    block.gyr[:, 1:] = 0.0
    chance, what = bias_removal_probability(
        windows, block, KEEPS, LEAST, (np.zeros(3), sigma)
    )
    assert chance > 0.9 and "of 6 means" in what


def test_few_of_gyroscopes_with_biases_read_zero_and_are_taken_for_such() -> None:
    """By Markov, at most one in as many as the likelihood ratio at which it is said."""
    rng, said, count = np.random.default_rng(23), 0, 3000
    windows, block = all_zero()
    odds = DOUBT / (1 - DOUBT) / TRACKING
    for sigma in rng.choice([3e-4, 1e-4, 1e-5], count):
        bias = rng.normal(0, np.hypot(sigma, REPEAT), 3)
        seen = bias, np.full(3, sigma)
        found = bias_removal_probability(windows, block, KEEPS, LEAST, seen)
        said += found[0] > DOUBT
    assert 0 < said / count < 1 / odds


def test_windows_without_noise_or_without_an_axis_do_not_count() -> None:
    windows, block = at_rest(np.random.default_rng(3), 0.0)
    block.gyr[COUNT : 2 * COUNT] = 0.0
    block.gyr[2 * COUNT : 3 * COUNT, 1] = np.nan
    assert "of 14 means" in bias_removal_probability(windows, block, KEEPS, LEAST)[1]
    # two windows of three axes are the fewest
    assert bias_removal_probability(windows[3:5], block, KEEPS, LEAST)[0] > 0.5
    assert bias_removal_probability(windows[2:4], block, KEEPS, LEAST) == (0.0, "")
    block.gyr[:, 0] = np.nan
    assert bias_removal_probability(windows, block, KEEPS, LEAST) == (0.0, "")


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


def test_means_of_exactly_zero_are_no_fault_of_the_check() -> None:
    windows, block = at_rest(np.random.default_rng(13), 0.0)
    block.gyr[:] = 5e-4 * np.where(np.arange(len(block)) % 2, 1.0, -1.0)[:, None]
    assert 0.0 <= bias_removal_probability(windows, block, KEEPS, LEAST)[0] <= 1.0


@pytest.mark.parametrize("trembles", [False, True])
def test_a_hand_hides_a_small_bias_and_never_rests(trembles: bool) -> None:
    """Of a gyroscope of 1e-4 rad/s; the same means at rest are those of a device that
    subtracts them."""
    rng, bias, said = np.random.default_rng(8), np.array([1e-4, -8e-5, 6e-5]), 0
    t = np.arange(20 * 400) / RATE
    for _ in range(5):
        gyr = np.zeros((len(t), 3)) if not trembles else np.tile(bias, (len(t), 1))
        gyr += NOISE / 10 * rng.standard_normal(gyr.shape)
        if trembles:  # angles of a tenth of a degree, at frequencies of a hand
            for hz in rng.uniform(0.5, 6.0, 8):
                swing = np.deg2rad(0.05) * rng.standard_normal(3) * 2 * np.pi * hz
                gyr += np.outer(np.cos(2 * np.pi * hz * t + rng.uniform(0, 6)), swing)
        windows = [
            Average(np.zeros(6), np.eye(6), 21.0, 400, 4.0 * k, 4.0 * (k + 1))
            for k in range(20)
        ]
        block = Block.of(t, np.zeros_like(gyr), gyr)
        chance, _ = bias_removal_probability(windows, block, KEEPS, LEAST)
        said += chance > DOUBT
    assert said == (0 if trembles else 5)
