"""Noise of windows, and what rounding leaves of their means."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.noise import (
    noise_of,
    rounding_noise,
    rounding_sigma,
    shared_rounding_sigma,
)

RATE = 100.0
WHITE = np.array([1e-2, 2e-2, 3e-2, 1e-4, 2e-4, 3e-4])
WINDOWS = np.array([[0, 2000], [2500, 2500], [3000, 6000]])


def recorded(step: Array | None = None) -> Block:
    """White noise; outputs rounded to steps where these are not 0."""
    rng = np.random.default_rng(3)
    six = WHITE * rng.standard_normal((6000, 6)) + [0.1, -9.8, 0.2, 0.01, 0.02, 0.03]
    six[2000:3000] += np.linspace(0, 7, 1000)[:, None]  # the device is turned
    if step is not None:
        six = np.where(
            step > 0, np.round(six / np.where(step > 0, step, 1.0)) * step, six
        )
    return Block.of(np.arange(6000) / RATE, six[:, :3], six[:, 3:])


def test_noise_is_that_inside_windows() -> None:
    found = noise_of(recorded(), WINDOWS, RATE)
    np.testing.assert_allclose(found.white, WHITE, rtol=0.1)
    np.testing.assert_allclose(found.quick, WHITE, rtol=0.1)


def test_steps_of_each_output() -> None:
    step = np.array([0.05, 0.0, 0.1, 0.0, 1e-3, 0.0])
    some = step > 0
    block = recorded(step)
    np.testing.assert_allclose(
        rounding_noise(block, WINDOWS)[:, some],
        np.tile(step[some] / 12**0.5, (2, 1)),
    )
    np.testing.assert_array_less(rounding_noise(block, WINDOWS)[:, ~some], 1e-4)
    off = rounding_sigma(block, WINDOWS)
    assert off.shape == (2, 6), "of windows that hold samples"
    np.testing.assert_array_less(off[:, ~some], 1e-8)
    still = recorded(np.repeat([1.0, 0.5], 3))
    np.testing.assert_allclose(
        rounding_sigma(still, WINDOWS),
        np.tile(np.repeat([1.0, 0.5], 3) / 12**0.5, (2, 1)),
    )


def test_a_step_that_only_a_turn_shows() -> None:
    """A step that the noise nowhere crosses in a window is seen on the way."""
    block = recorded(np.repeat([1.0, 0.0], 3))
    grain = rounding_noise(block, WINDOWS)
    np.testing.assert_allclose(grain[:, :3], np.full((2, 3), 1.0 / 12**0.5))
    assert (grain[:, 3:] < 1e-6).all()


def test_the_more_noise_the_less_rounding_is_left() -> None:
    """Sheppard: of noise of a third of a step hardly any is."""
    step = np.repeat([0.03, 1.0], 3) * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    off = rounding_sigma(recorded(step), WINDOWS)[0]
    assert 3e-4 < off[0] < 0.03 / 12**0.5 and off[1] < 1e-4


def test_the_bias_at_rest_is_off_by_the_same_in_all_windows() -> None:
    """Of noise far below a step their mean is no better than one of them."""
    rng, pulls, apart = np.random.default_rng(11), [], []
    windows = (np.arange(0, 2400, 200)[:, None] + [0, 190]).astype(np.intp)
    for _ in range(25):
        bias, noise = rng.uniform(-1, 1, 3), rng.uniform(0.03, 0.08)
        rates = bias + noise * rng.standard_normal((2400, 3))
        on_the_way = np.arange(2400) % 200 > 190
        rates[on_the_way] += 40 * rng.standard_normal((108, 3))
        acc = rng.normal(0, 9, (12, 3)).repeat(200, axis=0)
        block = Block.of(np.arange(2400) / RATE, acc + rates, 0.01 * np.round(rates))
        off = rounding_sigma(block, windows)
        alike = shared_rounding_sigma(block, windows, off)
        assert not alike[:3].any(), "no two rests are the same to accelerometers"
        means = np.array([block.gyr[a:b].mean(axis=0) for a, b in windows])
        own = (off[:, 3:] ** 2).mean(axis=0) / len(windows)
        error = means.mean(axis=0) - 0.01 * bias
        pulls.append(error / np.sqrt(alike[3:] ** 2 + own))
        apart.append(error / np.sqrt(own))
    assert 0.75 < np.sqrt(np.mean(np.square(pulls))) < 1.1
    assert np.sqrt(np.mean(np.square(apart))) > 2.5


def test_means_at_different_places_in_a_step_have_nothing_in_common() -> None:
    block = recorded(np.repeat([0.0, 0.5], 3))
    away = block.gyr + np.arange(6000)[:, None] / 6000 * 13.3
    off = np.full((2, 6), 0.1)
    found = shared_rounding_sigma(
        replace(block, gyr=0.5 * np.round(2 * away)), WINDOWS, off
    )
    assert (found < 0.06).all()
    assert not shared_rounding_sigma(block, WINDOWS[:1], off[:1]).any(), (
        "one has its own"
    )


def test_samples_that_are_missing_do_not_hide_what_means_have_in_common() -> None:
    block = recorded(np.repeat([0.0, 0.5], 3))
    off = rounding_sigma(block, WINDOWS)
    told = shared_rounding_sigma(block, WINDOWS, off)
    assert (told[3:] > 0.1).all()
    block.gyr[50:100, :2] = np.nan
    np.testing.assert_allclose(shared_rounding_sigma(block, WINDOWS, off), told)
    block.gyr[:2000, 2] = np.nan
    assert shared_rounding_sigma(block, WINDOWS, off)[5] == 0, "one window is left"


def test_what_does_not_move_is_off_by_the_same_in_every_window() -> None:
    """By all of its error; one window in which it shook does not change that."""
    step, held = 0.3, np.tile([0.13, -0.4, 0.55], (6000, 1))
    windows = (np.arange(0, 6000, 1000)[:, None] + [0, 900]).astype(np.intp)
    rng = np.random.default_rng(2)
    on_the_way = np.arange(6000) % 1000 > 900
    held[on_the_way] += 5 * rng.standard_normal((int(on_the_way.sum()), 3))
    still = step * np.round(held / step)
    held[2000:2900] += step * rng.standard_normal((900, 3))
    shaken = step * np.round(held / step)
    sigma = np.full((6, 6), 0.02)
    for rates, least in ((still, 0.0199), (shaken, 0.01)):
        block = Block.of(np.arange(6000) / RATE, 9 * rng.standard_normal((6000, 3)),
                         rates)  # fmt: skip
        alike = shared_rounding_sigma(block, windows, sigma)[3:]
        assert (alike > least).all() and (alike < 0.0201).all()


def test_windows_share_what_the_usual_noise_leaves_and_not_the_largest() -> None:
    """Of values without noise the covariance over a step v apart is a parabola.

    One of five windows has noise of a step; what is usual has none.
    """
    step, n = 0.5, 1000
    rng = np.random.default_rng(5)
    gyr = np.zeros((5 * n, 3)) + step * np.array([1.0, -2.0, 3.0])
    gyr[:n] += step * np.round(rng.standard_normal((n, 3)) + [0.0, 0.2, 0.4])
    block = Block.of(np.arange(5 * n) / RATE, rng.standard_normal((5 * n, 3)), gyr)
    windows = (np.arange(0, 5 * n, n)[:, None] + [0, n]).astype(np.intp)
    off = np.full((5, 6), 0.1) * np.array([[1.0], [2.0], [3.0], [4.0], [5.0]])
    apart = (gyr[:n].mean(axis=0) - gyr[n]) / step % 1.0
    one = 6 * (apart**2 - apart + 1 / 6)  # in units of q^2 / 12
    share = (4 * one + 6 * 1.0) / 10  # of ten pairs, six of windows alike
    found = shared_rounding_sigma(block, windows, off)
    expected = np.sqrt(share * np.mean(off[:, 0] ** 2))
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, *expected], rtol=1e-6)
