"""Outputs that a program smoothed: found, as well as stated, and undone."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import butter, lfilter
from smoothed_outputs import NOISE, held, smoothed

from fieldcal.core.samples import Array, Index
from fieldcal.windows.autoregression import Share
from fieldcal.windows.smoothing import find_smoothing, without_smoothing

NONE = np.zeros(3)


def both(
    acc: Array, gyr: Array, windows: Index, step: float = 0.0
) -> tuple[Share | None, Share | None]:
    """The smoothing that is found of each sensor."""
    return find_smoothing(np.hstack([acc, gyr]), windows, np.full(6, step))


def found(y: Array, windows: Index, step: float = 0.0) -> Share:
    """The smoothing that is found of a sensor; the other one sends no signal."""
    one, none = both(y, 0 * y, windows, step)
    assert one is not None and none is None
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


def test_decays_tell_k_as_well_as_is_said() -> None:
    pulls, sigmas = [], []
    for seed in range(20):
        kept = math.exp(-1 / np.random.default_rng(seed).uniform(8, 60))
        x, windows = held(seed)
        one = found(smoothed(x, kept), windows)
        pulls.append((one.kept - kept) / one.sigma)
        sigmas.append(one.samples_sigma / one.samples)
    assert 0.7 < np.std(pulls) < 1.4
    assert abs(np.mean(pulls)) < 0.6
    assert np.median(sigmas) < 0.005


def test_noise_alone_tells_k_roughly() -> None:
    for seed in range(8):
        x, windows = held(seed, jump=0.0)
        one = found(smoothed(x, math.exp(-1 / 30)), windows)
        assert one.samples == pytest.approx(30, abs=2.5 * one.samples_sigma)
        assert 0.2 < one.samples_sigma / one.samples < 0.3


def test_a_window_that_begins_in_a_turn_does_not_mislead() -> None:
    for seed in range(8):
        x, windows = held(seed, early=120)
        one = found(smoothed(x, math.exp(-1 / 40)), windows)
        assert one.samples == pytest.approx(40, abs=6 * one.samples_sigma)
        assert one.samples_sigma < 0.5


@pytest.mark.parametrize("step", [3e-4, 1e-3])
def test_rounding_behind_the_filter_makes_k_no_smaller(step: float) -> None:
    off = []
    for seed in range(12):
        x, windows = held(seed, jump=0.0)
        y = np.round(smoothed(x, math.exp(-1 / 30)) / step) * step
        one = found(y, windows, step)
        off.append(one.samples / 30 - 1)
    assert abs(np.mean(off)) < 0.05


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
        assert both(y, 0 * y, windows, step) == (None, None)


def test_windows_that_hold_nothing_say_nothing() -> None:
    y, windows = np.full((500, 3), np.nan), np.array([[0, 500]])
    assert both(y, y, windows) == (None, None)
    assert both(0 * y + 1, np.zeros((500, 3)), windows) == (None, None)
    assert both(np.zeros((50, 3)), np.zeros((50, 3)), windows) == (None, None)


def test_a_walk_through_all_of_a_rest_is_no_filter() -> None:
    """Its k comes as near to 1 as one likes, and so would what must be looked at."""
    rng = np.random.default_rng(4)
    y, windows = np.cumsum(rng.normal(size=(9000, 6)), axis=0), np.array([[0, 9000]])
    assert find_smoothing(y, windows, np.zeros(6)) == (None, None)
    assert find_smoothing(np.cumsum(y, axis=0), windows, np.zeros(6)) == (None, None)


def test_one_program_smooths_both_sensors_alike() -> None:
    """As well as the better of them says, whose turns were longer."""
    for seed in range(4):
        x, windows = held(seed, jump=0.02)
        w, _ = held(seed + 100)
        acc, gyr = both(smoothed(x, 0.97), smoothed(w, 0.97), windows)
        assert acc is not None and acc == gyr
        assert acc.kept == pytest.approx(0.97, abs=5 * acc.sigma)
        other = both(smoothed(x, 0.97), smoothed(w, 0.9), windows)
        assert other[0] is not None and other[1] is not None
        assert other[0].kept - other[1].kept == pytest.approx(0.07, abs=0.02)


@pytest.mark.parametrize("own", ["filter", "flicker"])
def test_noise_of_a_sensor_that_is_not_white(own: str) -> None:
    """Its own filter remembers a few samples; slow parts are left to the decays."""
    for seed in range(6):
        x, windows = held(seed, noise=0.0)
        white = np.random.default_rng(seed).normal(0, NOISE, x.shape)
        if own == "filter":
            x = x + lfilter(
                [0.5, 0.5], [1.0], lfilter([0.6], [1.0, -0.4], white, axis=0)
            )
        else:
            x = x + white + 0.005 * np.cumsum(white, axis=0)
        one = found(smoothed(x, math.exp(-1 / 45)), windows)
        assert one.samples == pytest.approx(45, rel=0.02)


def test_a_sensor_that_is_not_smoothed_is_left_beside_one_that_is() -> None:
    for seed in range(6):
        x, windows = held(seed)
        w, _ = held(seed + 100)
        for plain in (w, _quick(w)):
            acc, gyr = both(smoothed(x, 0.98), plain, windows)
            assert acc is not None and gyr is None
