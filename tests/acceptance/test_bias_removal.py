"""Gyroscopes whose bias the device subtracts at rest, and such as are merely small."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from fieldcal.acceptance.bias_cases import DEPENDENCE, BiasSpread
from fieldcal.acceptance.bias_removal import (
    DOUBT,
    TRACKING,
    bias_removal_probability,
)
from fieldcal.core.samples import Array, Block
from fieldcal.windows import Average

NOISE, RATE = 5e-4, 100.0
COUNT, HELD = 3000, 30.0
REPEAT = 1e-3
KEEPS = BiasSpread(REPEAT)
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
        if tracks_s:
            one -= running_mean(one, np.full(3, bias + NOISE), tracks_s)
        gyr.append(one)
    block = Block.of(
        np.arange(6 * COUNT) / RATE, np.zeros((6 * COUNT, 3)), np.concatenate(gyr)
    )
    windows = [
        Average(np.zeros(6), np.eye(6), 21.0, COUNT, HELD * k, HELD * (k + 1))
        for k in range(6)
    ]
    return windows, block


def running_mean(rates: Array, begins: Array, seconds: float) -> Array:
    """The mean over some seconds, (n, 3), that was another one before."""
    keep = np.exp(-1 / RATE / seconds)
    found, _ = lfilter([1 - keep], [1, -keep], rates, axis=0, zi=keep * begins[None])
    mean: Array = found
    return mean


def test_a_bias_or_the_earths_rate_stands_out() -> None:
    rng = np.random.default_rng(1)
    for bias, earth in ((1e-3, 0.0), (-1e-4, 0.0), (0.0, EARTH)):
        found = [
            bias_removal_probability(*at_rest(rng, bias, earth=earth), KEEPS)[0]
            for _ in range(6)
        ]
        assert max(found) <= DOUBT


def test_so_noisy_a_device_may_be_at_zero_by_chance() -> None:
    rng = np.random.default_rng(5)
    windows, block = at_rest(rng, 0.0)
    block.gyr[:] *= 100.0
    assert bias_removal_probability(windows, block, KEEPS)[0] < DOUBT


def test_a_bias_that_is_tracked_leaves_nothing() -> None:
    """What is followed within a few seconds looks as if means were subtracted."""
    rng = np.random.default_rng(2)
    for seconds in (0.5, 3.0, 15.0, 100.0):
        windows, block = at_rest(rng, -7e-3, seconds)
        chance, what = bias_removal_probability(windows, block, KEEPS)
        assert chance > 0.5
        assert "time constant" in what or (seconds < 5 and "as a mean over" in what)
    assert bias_removal_probability(windows[:1], block, KEEPS) == (0.0, "")


@pytest.mark.parametrize("each", [pytest.param(2, marks=pytest.mark.thorough), 6])
def test_what_is_tracked_is_seen_behind_lines_between_samples(each: int) -> None:
    """A program that drew them left less noise than means have; a bias stays one."""
    rng, found = np.random.default_rng(14), []
    for bias, tracks_s in ((0.0, 3.0), (2e-3, 0.0)):
        for _ in range(5):
            windows, block = at_rest(rng, bias, tracks_s)
            lines = [
                np.interp(block.t, block.t[::each], w[::each]) for w in block.gyr.T
            ]
            block.gyr[:] = np.column_stack(lines)
            found.append(bias_removal_probability(windows, block, KEEPS)[0])
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


@pytest.mark.parametrize("seconds", [1.0, 2.0, 6.0, 10.0])
def test_a_bias_that_is_taken_out_at_each_stop_leaves_noise(seconds: float) -> None:
    """Its means scatter by more than those of white noise, and are about zero."""
    rng = np.random.default_rng(4)
    for _ in range(3):
        windows, block = zeroed_at_rest(rng, -7e-3, seconds)
        chance, what = bias_removal_probability(windows, block, KEEPS)
        assert chance > DOUBT and "as a mean over" in what


def averaged_once(
    rng: np.random.Generator, seconds: float
) -> tuple[list[Average], Block]:
    """Of an autopilot that averaged its gyroscopes before the first window, once."""
    windows, block = at_rest(rng, 0.0, earth=EARTH)
    block.gyr[:] -= NOISE / np.sqrt(RATE * seconds) * rng.standard_normal(3)
    return windows, block


@pytest.mark.thorough
def test_an_autopilot_that_averaged_once_keeps_its_bias() -> None:
    """Above all where it tells the offset; one that tracks its bias has none."""
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
                bool(bias_removal_probability(windows, block, keeps)[0] > DOUBT)
            )
        windows, block = at_rest(rng, -7e-3, 3.0)
        keeps = BiasSpread(REPEAT, averaged=True)
        tracking.append(
            bool(bias_removal_probability(windows, block, keeps)[0] > DOUBT)
        )
    assert sum(told) <= 2
    assert sum(unknown) < 20  # what is left is as small as the Earth's rate
    assert np.mean(tracking) > 0.9


def test_windows_too_short_or_too_coarse_show_no_stop() -> None:
    """Of 0.2 s, or of samples so rare that the first mean is of more than a second."""
    rng = np.random.default_rng(6)
    windows, block = at_rest(rng, -7e-3, 1.0)
    short = [replace(w, end=w.start + 0.2) for w in windows]
    slow = Block.of(block.t * 50, block.acc, block.gyr)
    long = [replace(w, start=50 * w.start, end=50 * w.end) for w in windows]
    for some, recorded in ((short, block), (long, slow)):
        assert 0 <= bias_removal_probability(some, recorded, KEEPS)[0] <= 1


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
        lying = DEPENDENCE[-1] * REPEAT * rng.standard_normal((6, 3))
        block.gyr[:] += np.repeat(lying, COUNT, axis=0)
        taken += bias_removal_probability(windows, block, KEEPS)[0] > DOUBT
    assert taken <= 0.01 * count


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
    chance, what = bias_removal_probability(windows, block, KEEPS, seen)
    assert DOUBT < chance == pytest.approx(expected) and "all samples are zero" in what
    for other in (bias + [2e-3, 0.0, 0.0], np.full(3, np.nan)):
        found = bias_removal_probability(windows, block, KEEPS, (other, sigma))
        assert found[0] <= TRACKING
    averaged = BiasSpread(REPEAT, averaged=True)
    odds = TRACKING * ratio / ((ratio + 1) / 2)
    found = bias_removal_probability(windows, block, averaged, seen)
    assert found[0] == pytest.approx(odds / (1 + odds))


def test_an_axis_with_a_bias_beside_axes_of_zeros_keeps_it() -> None:
    sigma = np.full(3, 1e-5)
    for biased, keeps in ((0, False), (1, True)):
        windows, block = all_zero(biased)
        seen = block.gyr.mean(axis=0), sigma
        chance, _ = bias_removal_probability(windows, block, KEEPS, seen)
        assert (chance < 0.01) == keeps
    windows, block = at_rest(np.random.default_rng(22), 0.0)  # noise about zero
    block.gyr[:, 1:] = 0.0
    chance, what = bias_removal_probability(windows, block, KEEPS, (np.zeros(3), sigma))
    assert chance > 0.9


def test_few_of_gyroscopes_with_biases_read_zero_and_are_taken_for_such() -> None:
    """By Markov, at most one in as many as the likelihood ratio at which it is said."""
    rng, said, count = np.random.default_rng(23), 0, 1000
    windows, block = all_zero()
    odds = DOUBT / (1 - DOUBT) / TRACKING
    for sigma in rng.choice([3e-4, 1e-4, 1e-5], count):
        bias = rng.normal(0, np.hypot(sigma, REPEAT), 3)
        seen = bias, np.full(3, sigma)
        found = bias_removal_probability(windows, block, KEEPS, seen)
        said += found[0] > DOUBT
    assert 0 < said / count < 1 / odds


def test_windows_without_noise_or_without_an_axis_do_not_count() -> None:
    windows, block = at_rest(np.random.default_rng(3), -7e-3, 3.0)
    block.gyr[COUNT : 2 * COUNT] = 0.0
    block.gyr[2 * COUNT : 3 * COUNT, 1] = np.nan
    # two windows of three axes are the fewest
    for some in (windows, windows[3:5]):
        assert bias_removal_probability(some, block, KEEPS)[0] > 0.9
    assert bias_removal_probability(windows[2:4], block, KEEPS) == (0.0, "")
    block.gyr[:, 0] = np.nan
    assert bias_removal_probability(windows, block, KEEPS) == (0.0, "")


@pytest.mark.parametrize(
    ("size", "most"), [(0.1, 3), pytest.param(0.3, 1, marks=pytest.mark.thorough)]
)
def test_a_bias_that_is_merely_small_is_kept(size: float, most: int) -> None:
    """As after a calibration; the dependence on how the device lies is as small.

    Of those that are smaller than the Earth's rate many are taken for removed; that
    they are not can be stated.
    """
    rng, taken = np.random.default_rng(17), 0
    for _ in range(20):
        windows, block = at_rest(rng, 0.0, earth=EARTH)
        block.gyr[:] += size * REPEAT * rng.standard_normal(3)
        lying = 0.1 * size * REPEAT * rng.standard_normal((6, 3))
        block.gyr[:] += np.repeat(lying, COUNT, axis=0)
        taken += bias_removal_probability(windows, block, KEEPS)[0] > DOUBT
    assert taken <= most


def turned(
    rng: np.random.Generator, bias: float, tau: float, away_s: float = 0.0
) -> tuple[list[Average], Block]:
    """Six windows with turns of 4 s between them, in which nothing is followed.

    The device may be off in one of the gaps, and have another bias afterwards.
    """
    pause = int(8 * RATE)
    total = 6 * COUNT + 5 * pause
    gyr, t = NOISE * rng.standard_normal((total, 3)) + bias, np.arange(total) / RATE
    moves, windows = np.zeros(total, bool), []
    for k in range(6):
        first = k * (COUNT + pause)
        gyr[first : first + COUNT + pause // 4, k % 3] += EARTH
        moves[first + COUNT + pause // 4 : first + COUNT + 3 * pause // 4] = True
        windows.append((first, first + COUNT))
    gyr[moves] += 0.3
    if np.isfinite(tau):
        rests = np.cumsum(~moves) - 1  # the last sample at rest
        gyr -= running_mean(gyr[~moves], gyr[0], tau)[rests]
    if away_s:
        gyr[windows[3][0] :] += REPEAT * rng.standard_normal(3)
        t[windows[3][0] - pause // 2 :] += away_s
    block = Block.of(t, np.zeros((total, 3)), gyr)
    spans = [(float(t[a]), float(t[b - 1]) + 0.5 / RATE) for a, b in windows]
    return [Average(np.zeros(6), np.eye(6), 21.0, COUNT, *s) for s in spans], block


@pytest.mark.parametrize("tau", [8.0, 30.0, 100.0])
def test_what_is_followed_slowly_returns_to_zero_from_window_to_window(
    tau: float,
) -> None:
    rng, found = np.random.default_rng(18), []
    for _ in range(4):
        windows, block = turned(rng, -7e-3, tau)
        chance, what = bias_removal_probability(windows, block, KEEPS)
        assert chance > DOUBT and "time constant of about" in what
        found.append(float(what.split()[-2]))
    assert tau / 3 < np.median(found) < 3 * tau


def test_a_statement_that_it_keeps_its_bias_is_believed() -> None:
    windows, block = at_rest(np.random.default_rng(2), -7e-3, 3.0)
    stated = BiasSpread(REPEAT, stated=True)
    assert bias_removal_probability(windows, block, stated) == (0.0, "")


def test_other_biases_after_a_restart_are_no_sign_of_it() -> None:
    rng = np.random.default_rng(19)
    for away_s in (0.0, 60.0):
        for _ in range(4):
            windows, block = turned(rng, 1e-3, np.inf, away_s)
            assert bias_removal_probability(windows, block, KEEPS)[0] < 0.01


def test_means_of_exactly_zero_are_no_fault_of_the_check() -> None:
    windows, block = at_rest(np.random.default_rng(13), 0.0)
    block.gyr[:] = 5e-4 * np.where(np.arange(len(block)) % 2, 1.0, -1.0)[:, None]
    assert 0.0 <= bias_removal_probability(windows, block, KEEPS)[0] <= 1.0


def test_steps_with_hardly_any_noise_are_no_fault_of_the_check() -> None:
    """Noise of a millionth of the bias; or one sample in a thousand a step higher."""
    windows, block = at_rest(np.random.default_rng(24), 0.0)
    block.gyr[:] = 1e-3 + 1e-9 * np.random.default_rng(25).standard_normal((18_000, 3))
    assert bias_removal_probability(windows, block, KEEPS)[0] < 0.01
    block.gyr[:] = 1e-3
    block.gyr[:] += 1e-6 * (np.random.default_rng(26).random((18_000, 3)) < 1e-3)
    assert 0.0 <= bias_removal_probability(windows, block, KEEPS)[0] < 0.01


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
        chance, _ = bias_removal_probability(windows, block, KEEPS)
        said += chance > DOUBT
    assert said == (0 if trembles else 5)
