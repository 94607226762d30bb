"""Waves of greatest evidence, and planned windows, by direct calculation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import minimize

from fieldcal.core.samples import Array
from fieldcal.windows.sway_process import fit_waves, needed_seconds
from fieldcal.windows.sway_waves import SwayWaves

FORCE = np.array([1.0, -9.0, 4.0])
DRIFT = np.array([2e-4, 2e-4, 2e-4, 2e-5, 2e-5, 2e-5])
LENGTH, MIDDLE = 0.4, 107.0


def waves_of(hz: Array, cos: Array, sin: Array, noise: Array) -> SwayWaves:
    zero = np.zeros(len(noise))
    return SwayWaves(
        hz, MIDDLE, cos, sin, FORCE, np.zeros(3), zero, noise, LENGTH,
        (MIDDLE - 12.0, MIDDLE + 12.0),
    )  # fmt: skip


def columns(t: Array, hz: Array) -> Array:
    """Means over cells of cosines and sines, and the drift: (m, 2 k + 1)."""
    fine = np.linspace(-LENGTH / 2, LENGTH / 2, 2001)
    phase = 2 * np.pi * hz * (t[:, None, None] - MIDDLE + fine[:, None])
    s = (t - MIDDLE) / (t[-1] - MIDDLE)
    return np.column_stack([np.cos(phase).mean(axis=1), np.sin(phase).mean(axis=1), s])


@pytest.mark.parametrize("channels", [3, 6])
def test_waves_and_noise_are_those_of_greatest_evidence(channels: int) -> None:
    """Of two waves, one of which some outputs hide; found by a general search."""
    rng, hz = np.random.default_rng(channels), np.array([0.13, 0.37])
    t = MIDDLE + LENGTH * (np.arange(45) - 22)
    table = columns(t, hz)
    rate = np.tile(2 * np.pi * hz[:, None], 3)
    size = np.hstack([np.full((2, 3), np.linalg.norm(FORCE)), rate])[:, :channels]
    sigma = np.repeat([5e-3, 2e-3], 3)[:channels] * np.array([1, 3, 1] * 2)[:channels]
    true = np.tile(size, (2, 1)) * [[8e-4], [2e-3], [5e-4], [1e-3]]
    true *= rng.standard_normal(true.shape)
    true = np.vstack([true, DRIFT[:channels]])
    y = 3.0 + table @ true + sigma * rng.standard_normal((45, channels))
    # what the mean leaves: 44 dimensions
    across = null_space(np.ones((1, 45))).T
    seen, design = across @ y, across @ table
    scale = np.vstack([np.tile(size, (2, 1)), DRIFT[:channels]])

    def prior(v: Array) -> Array:
        variance: Array = scale**2 * np.append(np.tile(v, 2), 1.0)[:, None]
        return variance

    def missed(p: Array) -> float:
        wide, noise, total = prior(np.exp(p[:2])), np.exp(p[2:]), 0.0
        for c in range(channels):
            cov = noise[c] * np.eye(44) + design * wide[:, c] @ design.T
            total += np.linalg.slogdet(cov)[1]
            total += seen[:, c] @ np.linalg.solve(cov, seen[:, c])
        return float(total)

    begin = np.append(np.full(2, np.log(1e-6)), 2 * np.log(sigma))
    best = minimize(missed, begin, method="BFGS", options={"gtol": 1e-3}).x
    wide, noise = prior(np.exp(best[:2])), np.exp(best[2:])
    found = fit_waves(t, y, hz, waves_of(hz[:0], y[:0], y[:0], np.ones(channels)))
    assert found is not None
    np.testing.assert_array_equal(found.hz, hz)
    np.testing.assert_allclose(found.noise, noise, rtol=5e-3)
    both = np.ones(45) @ table / 45
    for c in range(channels):
        cov = np.linalg.inv(design.T @ design / noise[c] + np.diag(1 / wide[:, c]))
        mean = cov @ design.T @ seen[:, c] / noise[c]
        sd = np.sqrt(np.diag(cov))
        np.testing.assert_allclose(found.cos[:, c], mean[:2], atol=0.02 * sd.max())
        np.testing.assert_allclose(found.sin[:, c], mean[2:4], atol=0.02 * sd.max())
        assert found.excess_variance[c] == pytest.approx(both @ cov @ both, rel=0.02)


def test_a_wave_that_no_output_shows_is_left_out() -> None:
    rng, hz = np.random.default_rng(1), np.array([0.13, 0.25, 0.37])
    t = MIDDLE + LENGTH * (np.arange(60) - 29.5)
    y = 5e-3 * rng.standard_normal((60, 3))
    plain = waves_of(hz[:0], y[:0], y[:0], np.ones(3))
    assert fit_waves(t, y, hz, plain) is None
    y[:, 1] += 0.05 * np.cos(2 * np.pi * 0.25 * t)  # in one output alone
    found = fit_waves(t, y, hz, plain)
    assert found is not None
    np.testing.assert_array_equal(found.hz, [0.25])
    size = np.hypot(found.cos, found.sin)[0] * np.sinc(0.25 * LENGTH)
    np.testing.assert_allclose(size, [0.0, 0.05, 0.0], atol=4e-3)


def seconds_by_hand(waves: SwayWaves, channels: int) -> float:
    """By least squares of a constant, a drift and waves of known sizes."""
    turned, rate = waves.mean_squares
    for seconds in (10, 15, 20, 30, 45, 60, 90, 120, 180, 300, 600):
        if seconds < 1.2 * 2 * np.pi * np.sqrt(turned / rate):
            continue
        t = 0.25 * np.arange(4 * seconds)
        wave = 2 * np.pi * np.outer(t, waves.hz)
        all_of_them = np.column_stack(
            [np.ones_like(t), t - t.mean(), np.cos(wave), np.sin(wave)]
        )
        square = all_of_them.T @ all_of_them
        enough = True
        for c in range(channels):
            power = (waves.cos[:, c] ** 2 + waves.sin[:, c] ** 2) / 2
            known = 1 / np.tile(np.maximum(power, 1e-30), 2)
            noise = waves.noise[c] * waves.length / 0.25
            cov = np.linalg.inv(square / noise + np.diag(np.append([0, 0], known)))
            enough &= cov[0, 0] <= 1.5**2 * noise / len(t)
        if enough:
            return seconds
    return 600.0


def test_a_planned_window_is_the_first_of_the_ladder_that_is_good_enough() -> None:
    rng, planned = np.random.default_rng(4), set()
    for i in range(60):
        count = int(rng.integers(1, 5))
        middle = np.exp(rng.uniform(np.log(4e-3), np.log(0.4)))
        hz = np.sort(middle * np.exp(rng.normal(0, 0.1, count)))
        cos, sin = rng.standard_normal((2, count, 6)) * np.exp(rng.normal(-4, 3))
        cos[:, 1] = sin[:, 1] = 0.0
        noise = np.repeat([1e-5, 1e-6], 3)
        channels = 3 if i % 2 else 6
        waves = waves_of(hz, cos, sin, noise)
        expected = seconds_by_hand(waves, channels)
        noise[channels:] = np.nan
        assert needed_seconds(waves) == expected
        planned.add(expected)
    assert planned == {10, 15, 20, 30, 45, 60, 90, 120, 180, 300, 600}


@pytest.mark.parametrize("middle", [0.04, 0.05])
def test_the_wave_that_needs_the_next_window_is_known_to_a_hundredth(
    middle: float,
) -> None:
    """Where a larger wave first needs a longer window, found by halving."""
    rng, hz = np.random.default_rng(6), middle * np.array([0.9, 1.0, 1.15])
    cos, sin = rng.standard_normal((2, 3, 6))
    noise = np.repeat([1e-5, 1e-6], 3)

    def waves(size: float) -> SwayWaves:
        return waves_of(hz, size * cos, size * sin, noise)

    small, large = 1e-6, 1.0
    shortest = seconds_by_hand(waves(small), 6)
    assert seconds_by_hand(waves(large), 6) > shortest
    while large > 1.005 * small:
        size = np.sqrt(small * large)
        if seconds_by_hand(waves(size), 6) > shortest:
            large = size
        else:
            small = size
    assert needed_seconds(waves(small)) == shortest
    assert needed_seconds(waves(large)) == seconds_by_hand(waves(large), 6)
