"""The rate of a temperature: as smooth as it is, as sharp as it must be."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows import thermometer
from fieldcal.model.rows.thermometer import Thermometer

T: Array = np.arange(0.0, 360.0, 0.1)


def rate_error(course: Array, seed: int) -> float:
    """Rms of what the rate is off by, K/s, of a thermometer with 20 mK of noise."""
    noise = 0.02 * np.random.default_rng(seed).standard_normal(len(T))
    still = np.zeros((len(T), 3))
    seen = Thermometer.of(Block.of(T, still, still, 25 + course + noise))
    truth = np.interp(seen.t, T, np.gradient(course, T))
    return float(np.sqrt(np.mean((seen.heating - truth) ** 2)))


@pytest.mark.parametrize("seed", range(3))
def test_what_rises_once_has_little_noise_even_at_its_ends(seed: int) -> None:
    assert rate_error(6 * (1 - np.exp(-T / 175)), seed) < 4e-4


@pytest.mark.parametrize("seed", range(3))
def test_what_goes_up_and_down_is_not_flattened(seed: int) -> None:
    course = 3 * np.sin(2 * np.pi * T / 240)
    spread = 3 * 2 * np.pi / 240 / 2**0.5
    assert rate_error(course, seed) < 0.05 * spread


def value_error(seen: Array, course: Array) -> tuple[float, Thermometer]:
    """Rms of what the temperature is off by, K, and the thermometer."""
    still = np.zeros((len(T), 3))
    found = Thermometer.of(Block.of(T, still, still, 25 + seen))
    truth = np.interp(found.t, T, course)
    off = found.start_c + found.warming - 25 - truth
    return float(np.sqrt(np.mean(off**2))), found


@pytest.mark.parametrize("period", [10.0, 20.0, 60.0, 300.0])
def test_a_course_of_seconds_is_seen_as_it_is(period: float) -> None:
    """Wind on a small box: a line of 24 s would leave nothing of it."""
    course = 2 * np.sin(2 * np.pi * T / period)
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(T))
    off, found = value_error(course + noise, course)
    assert off < 0.03
    assert found.changes


def test_the_steps_of_a_coarse_thermometer_are_no_course() -> None:
    """Whole kelvins: half a step off at most is what a line through them leaves."""
    course = T / 90
    off, found = value_error(np.round(course), course)
    assert off < 0.25
    assert np.abs(np.diff(found.warming)).max() < 0.2


def test_noise_alone_is_smoothed_and_no_change() -> None:
    noise = 0.05 * np.random.default_rng(2).standard_normal(len(T))
    off, found = value_error(noise, np.zeros(len(T)))
    assert off < 0.01
    assert not found.changes


def test_means_over_a_second_and_longer_ones_of_a_long_recording() -> None:
    """Instants and values are means of the samples that fall into each."""
    rate = 5.0
    t = 10.0 + np.arange(round(100 * rate)) / rate
    values = 20.0 + 0.01 * (t - 10.0)
    found = Thermometer.of(Block.of(t, np.zeros((len(t), 3)), None, values))
    assert len(found.t) == 100
    np.testing.assert_allclose(found.t, 10.4 + np.arange(100))
    np.testing.assert_allclose(found.warming, 0.01 * (found.t - 10.0), atol=1e-9)
    np.testing.assert_allclose(found.heating, 0.01, rtol=1e-6)
    assert found.start_c == pytest.approx(20.0)
    warming, heating = found.at(np.array([0.0, 30.0, 1e4]))
    np.testing.assert_allclose(warming, [0.004, 0.2, 0.994], atol=1e-9)
    np.testing.assert_allclose(heating, 0.01, rtol=1e-6)
    t = np.arange(0.0, 7200.0, 0.5)
    many = Thermometer.of(Block.of(t, np.zeros((len(t), 3)), None, 0.001 * t))
    assert 3600 <= len(many.t) <= 3601


def test_a_pause_makes_no_longer_steps() -> None:
    t = np.concatenate([np.arange(0.0, 300.0, 0.5), 1e5 + np.arange(0.0, 300.0, 0.5)])
    found = Thermometer.of(Block.of(t, np.zeros((len(t), 3)), None, 1e-4 * (t % 1e5)))
    assert len(found.t) == 600


def test_the_rate_is_told_on_both_sides_of_a_night() -> None:
    day = 86_400.0
    t = np.concatenate([np.arange(0.0, 600.0, 0.5), day + np.arange(0.0, 600.0, 0.5)])
    values = 20.0 + 0.01 * (t % day)
    found = Thermometer.of(Block.of(t, np.zeros((len(t), 3)), None, values))
    np.testing.assert_allclose(found.heating, 0.01, rtol=1e-3)


def test_few_values_are_no_thermometer() -> None:
    t, still = np.arange(20.0), np.zeros((20, 3))
    for known in (7, 8):
        values = np.where(np.arange(20) < known, 20.0, np.nan)
        found = Thermometer.of(Block.of(t, still, still, values))
        assert np.isfinite(found.start_c) == (known == 8)
        assert not found.changes
        assert np.isnan(found.at(t)[0]).all() == (known == 7)


@pytest.mark.parametrize(("change", "shows"), [(0.08, False), (0.13, True)])
def test_from_a_tenth_of_a_kelvin_a_change_is_one(change: float, shows: bool) -> None:
    t = np.arange(0.0, 300.0, 0.5)
    values = 20.0 + change * t / 300.0
    found = Thermometer.of(Block.of(t, np.zeros((len(t), 3)), None, values))
    assert found.changes == shows


def test_local_fits_are_those_of_all_means_within_their_span() -> None:
    """Of each instant by itself, weighted; both ends of a span are within it."""
    rng = np.random.default_rng(7)
    t = 400.0 + np.arange(60.0)
    y, weight = 20 + rng.standard_normal(60), rng.uniform(1.0, 3.0, 60)
    value, slope = thermometer._line(t, y, weight, 5.0)
    rate = thermometer._slope(t, y, weight, 5.0)
    for i, now in enumerate(t):
        near = np.abs(t - now) <= 5.0
        s, w = t[near] - now, np.sqrt(weight[near])
        line, bent = (np.polyfit(s, y[near], k, w=w)[::-1] for k in (1, 2))
        np.testing.assert_allclose([value[i], slope[i]], line, rtol=1e-7)
        assert rate[i] == pytest.approx(bent[1], rel=1e-6)
