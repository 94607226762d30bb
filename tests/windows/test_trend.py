"""The robust line against the Theil-Sen line of another library."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import theilslopes

from fieldcal.windows.trend import line


@pytest.mark.parametrize("m", [24, 25, 100, 600])
def test_a_straight_line_is_itself(m: int) -> None:
    values = np.arange(m)[:, None] * [0.5, -2.0, 0.0] + [3.0, 0.0, 1.0]
    np.testing.assert_allclose(line(values), values, atol=1e-9)


@pytest.mark.parametrize("m", [1, 7, 23])
def test_of_few_values_it_is_their_median(m: int) -> None:
    values = np.random.default_rng(m).normal(size=(m, 2)) + np.arange(m)[:, None]
    expected = np.broadcast_to(np.median(values, axis=0), (m, 2))
    np.testing.assert_array_equal(line(values), expected)


@pytest.mark.parametrize("m", [120, 131])
def test_it_is_that_of_theil_through_twelve_medians(m: int) -> None:
    values = np.random.default_rng(m).normal(size=(m, 2)) + np.arange(m)[:, None] / 30
    found = line(values)
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
    np.testing.assert_allclose(line(values), truth, atol=1e-9)


@pytest.mark.parametrize("noise", [0.4, 0.6, 0.9])
def test_of_rounded_values_it_is_no_step_of_theirs(noise: float) -> None:
    drawn = np.random.default_rng(6).normal(size=(1200, 40))
    middles = np.linspace(-0.5, 0.5, 40)
    values = np.round(middles + noise * drawn)
    off, plain = line(values, np.ones(40)) - middles, line(values) - middles
    assert off.std() < 0.12 and off.std() < 0.5 * plain.std()
    # a slope is as that of values which are not rounded
    rising = np.arange(1200)[:, None] * 0.002
    found = line(np.round(rising + middles + noise * drawn), np.ones(40))
    assert (found - rising - middles).std() < 0.12


def test_of_fine_values_the_step_says_nothing() -> None:
    values = np.random.default_rng(7).normal(size=(240, 3))
    fine = line(values, np.full(3, 1e-9))
    np.testing.assert_allclose(fine, line(values), atol=1e-8)
