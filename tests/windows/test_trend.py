"""The robust line against the Theil-Sen line of another library."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import theilslopes

from fieldcal.core.samples import Array
from fieldcal.windows.trend import drift_course, robust_lines


@pytest.mark.parametrize("m", [24, 25, 100, 600])
def test_a_straight_line_is_itself(m: int) -> None:
    values = np.arange(m)[:, None] * [0.5, -2.0, 0.0] + [3.0, 0.0, 1.0]
    np.testing.assert_allclose(robust_lines(values), values, atol=1e-9)


@pytest.mark.parametrize("m", [1, 7, 23])
def test_of_few_values_it_is_their_median(m: int) -> None:
    values = np.random.default_rng(m).normal(size=(m, 2)) + np.arange(m)[:, None]
    expected = np.broadcast_to(np.median(values, axis=0), (m, 2))
    np.testing.assert_array_equal(robust_lines(values), expected)


@pytest.mark.parametrize("m", [120, 131])
def test_it_is_that_of_theil_through_twelve_medians(m: int) -> None:
    values = np.random.default_rng(m).normal(size=(m, 2)) + np.arange(m)[:, None] / 30
    found = robust_lines(values)
    assert found.shape == (m, 2)
    size = m // 12
    for channel in range(2):
        y = values[:, channel]
        medians = [np.median(y[k * size : (k + 1) * size]) for k in range(12)]
        slope = theilslopes(medians, size * np.arange(12)).slope
        tilt = slope * np.arange(m)
        np.testing.assert_allclose(found[:, channel], tilt + np.median(y - tilt))


@pytest.mark.parametrize("at", [0, 50, 100])
def test_a_disturbance_of_a_sixth_does_not_turn_it(at: int) -> None:
    truth = np.arange(120)[:, None] * [0.01, -0.02]
    values = truth.copy()
    values[at : at + 20] += 7.0
    np.testing.assert_allclose(robust_lines(values), truth, atol=1e-9)


@pytest.mark.parametrize("noise", [0.4, 0.6, 0.9])
def test_of_rounded_values_it_is_no_step_of_theirs(noise: float) -> None:
    drawn = np.random.default_rng(6).normal(size=(1200, 40))
    middles = np.linspace(-0.5, 0.5, 40)
    values = np.round(middles + noise * drawn)
    off, plain = (
        robust_lines(values, np.ones(40)) - middles,
        robust_lines(values) - middles,
    )
    assert off.std() < 0.12 and off.std() < 0.5 * plain.std()
    # a slope is as that of values which are not rounded
    rising = np.arange(1200)[:, None] * 0.002
    found = robust_lines(np.round(rising + middles + noise * drawn), np.ones(40))
    assert (found - rising - middles).std() < 0.12


def test_of_fine_values_the_step_says_nothing() -> None:
    values = np.random.default_rng(7).normal(size=(240, 3))
    fine = robust_lines(values, np.full(3, 1e-9))
    np.testing.assert_allclose(fine, robust_lines(values), atol=1e-8)


def test_what_settles_over_hours_is_near_its_lines() -> None:
    t = np.arange(72_000) / 10
    for tau in (300.0, 1200.0, 4000.0):
        course = np.exp(-t / tau)[:, None]
        straight = np.polyfit(t, course[:, 0], 1)
        assert np.abs(robust_lines(course) - course).max() < 0.02
        assert np.abs(np.polyval(straight, t) - course[:, 0]).max() > 0.1


def test_each_section_has_the_line_of_its_own_values() -> None:
    values = np.random.default_rng(8).normal(size=(3600, 2))
    parts = [robust_lines(values[a : a + 1200]) for a in (0, 1200, 2400)]
    np.testing.assert_array_equal(robust_lines(values), np.concatenate(parts))


def about_two_means(y: Array) -> float:
    """Least sum of squares about a mean before and one after, by trying every one."""
    parts = [(y[:i], y[i:]) for i in range(1, len(y))]
    return min(float(sum(((p - p.mean()) ** 2).sum() for p in two)) for two in parts)


@pytest.mark.parametrize("seed", range(8))
def test_a_drift_is_what_a_line_describes_better_than_a_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(240, 20))
    values += rng.uniform(0, 3, 20) * (np.arange(240)[:, None] - 119.5) / 240
    values += rng.uniform(0, 3, 20) * (np.arange(240)[:, None] > rng.integers(240))
    laid = robust_lines(values)
    found, drifts = drift_course(values, laid), 0
    for y, line, course in zip(values.T, laid.T, found.T, strict=True):
        slope = (line[-1] - line[0]) / 239
        better = ((y - line) ** 2).sum() < about_two_means(y)
        drifts += better
        np.testing.assert_allclose(np.diff(course), slope * better, atol=1e-12)
    assert 2 <= drifts <= 18


def test_a_step_between_two_sections_is_no_drift() -> None:
    values = np.random.default_rng(9).normal(size=(2400, 1))
    values += 1e-2 * np.arange(2400)[:, None]
    values[1200:] -= 20.0
    course = drift_course(values, robust_lines(values))
    np.testing.assert_allclose(np.diff(course[:, 0]), 1e-2, atol=2e-4)
