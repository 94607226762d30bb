"""Outputs that a program smoothed: found, as well as stated, and undone."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from fieldcal.core.samples import Array, Index
from fieldcal.windows.smoothing import Smoothing, find_smoothing, without_smoothing

NONE = np.zeros(3)
WINDOW, PAUSE = 2000, 300
NOISE = 0.02


def smoothed(x: Array, kept: float) -> Array:
    """Sample by sample, as a program does it."""
    out = x.copy()
    for n in range(1, len(x)):
        out[n] = kept * out[n - 1] + (1 - kept) * x[n]
    return out


def held(
    seed: int, windows: int = 4, jump: float = 5.0, early: int = 0, noise: float = NOISE
) -> tuple[Array, Index]:
    """Outputs (n, 3) of a device held still between turns, and its windows.

    A window begins `early` samples before its turn ends.
    """
    rng = np.random.default_rng(seed)
    level, parts, bounds, n = rng.normal(0, jump, 3), [], [], 0
    for _ in range(windows):
        new = rng.normal(0, jump, 3)
        way = np.linspace(0, 1, PAUSE)[:, None]
        parts += [level + way * (new - level), np.tile(new, (WINDOW, 1))]
        bounds.append((n + PAUSE - early, n + PAUSE + WINDOW))
        level, n = new, n + PAUSE + WINDOW
    x = np.vstack(parts)
    return x + noise * rng.normal(size=x.shape), np.array(bounds, dtype=np.intp)


def found(y: Array, windows: Index, step: float = 0.0) -> Smoothing:
    """The smoothing that is found."""
    one = find_smoothing(y, windows, NONE + step)
    assert one is not None
    return one


def test_undoing_gives_the_samples_before() -> None:
    x, _ = held(1)
    t = np.arange(len(x)) / 100
    back = without_smoothing(smoothed(x, 0.98), t, 0.98)
    assert back == pytest.approx(x, abs=1e-9)


def test_a_sample_behind_a_gap_is_known_from_the_one_before_it() -> None:
    """Of a constant input y nears it by k a sample, and is as much nearer."""
    n, kept = np.arange(200), 0.95
    y = (3.0 + 2.0 * kept**n)[:, None]
    some = np.r_[0:50, 57:200]
    back = without_smoothing(y[some], some / 50, kept)
    assert back[1:] == pytest.approx(3.0, abs=1e-9)


@pytest.mark.parametrize("jump", [0.0, 5.0], ids=["by noise", "by decays"])
def test_k_is_known_as_well_as_is_said(jump: float) -> None:
    pulls, sigmas = [], []
    for seed in range(30):
        kept = math.exp(-1 / np.random.default_rng(seed).uniform(8, 60))
        x, windows = held(seed, jump=jump)
        one = found(smoothed(x, kept), windows)
        pulls.append((one.kept - kept) / one.sigma)
        sigmas.append(one.samples_sigma / one.samples)
    assert 0.75 < np.std(pulls) < 1.3
    assert abs(np.mean(pulls)) < 0.6
    assert np.median(sigmas) < (0.005 if jump else 0.15)


def test_a_window_that_begins_in_a_turn_does_not_mislead() -> None:
    for seed in range(8):
        x, windows = held(seed, early=120)
        one = found(smoothed(x, math.exp(-1 / 40)), windows)
        assert one.samples == pytest.approx(40, abs=6 * one.samples_sigma)
        assert one.samples_sigma < 0.5


@pytest.mark.parametrize("step", [3e-4, 1e-3])
def test_rounding_behind_the_filter_makes_k_no_smaller(step: float) -> None:
    off = []
    for seed in range(20):
        x, windows = held(seed, jump=0.0)
        y = np.round(smoothed(x, math.exp(-1 / 30)) / step) * step
        one = found(y, windows, step)
        off.append((one.samples - 30) / one.samples_sigma)
    assert abs(np.mean(off)) < 1
    assert np.std(off) < 1.6


def test_steps_that_hide_the_noise_leave_the_decays() -> None:
    for seed in range(10):
        x, windows = held(seed, noise=1e-3)
        y = np.round(smoothed(x, math.exp(-1 / 90)), 2)
        one = found(y, windows, 0.01)
        assert one.samples == pytest.approx(90, abs=5 * one.samples_sigma)
        assert one.samples_sigma < 5


def _running_mean(x: Array) -> Array:
    out: Array = lfilter(np.full(40, 1 / 40), [1.0], x - x[0], axis=0) + x[0]
    return out


def _low_pass_of_second_order(x: Array) -> Array:
    b, a = butter(2, 0.02)
    out: Array = lfilter(b, a, x - x[0], axis=0) + x[0]
    return out


def _wandering(x: Array) -> Array:
    rng = np.random.default_rng(99)
    return x + np.cumsum(rng.normal(0, 0.002, x.shape), axis=0)


def _swaying(x: Array) -> Array:
    """A process of first order, as strong as the white noise beside it."""
    rng = np.random.default_rng(98)
    noise = rng.normal(0, 0.3 * NOISE, x.shape)
    out: Array = x + lfilter([1.0], [1.0, -0.95], noise, axis=0)
    return out


def _quick(x: Array) -> Array:
    return smoothed(x, math.exp(-1 / 2))


@pytest.mark.parametrize(
    "other",
    [
        np.asarray,
        _running_mean,
        _low_pass_of_second_order,
        _wandering,
        _swaying,
        _quick,
    ],
)
@pytest.mark.parametrize("step", [0.0, 0.01])
def test_nothing_else_is_taken_for_it(
    other: Callable[[Array], Array], step: float
) -> None:
    for seed in range(3):
        x, windows = held(seed)
        y = other(x)
        y = np.round(y / step) * step if step else y
        assert find_smoothing(y, windows, NONE + step) is None


def test_windows_that_hold_nothing_say_nothing() -> None:
    y = np.full((500, 3), np.nan)
    assert find_smoothing(y, np.array([[0, 500]]), NONE) is None
    assert find_smoothing(np.zeros((500, 3)), np.array([[0, 500]]), NONE) is None
    assert find_smoothing(np.zeros((50, 3)), np.array([[0, 50]]), NONE) is None
