"""Even knots, and cubics between them, against a polynomial and a ramp with a pause."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from fieldcal.model.rows.knots import even_times, hermite_spline, spline_through


def test_a_cubic_is_met_between_uneven_knots() -> None:
    t = np.array([0.0, 0.3, 1.0, 1.1, 2.5])
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 0.7])
    values = np.stack([cubic(t), -3 * cubic(t)], axis=1)
    change = np.stack([cubic.deriv()(t), -3 * cubic.deriv()(t)], axis=1)
    found = hermite_spline(t, values, change)
    at = np.linspace(0.0, 2.5, 77)
    np.testing.assert_allclose(found(at)[:, 0], cubic(at), atol=1e-12)
    np.testing.assert_allclose(found(at, 2)[:, 1], -3 * cubic.deriv(2)(at), atol=1e-11)


def test_even_times_begin_anew_after_a_pause() -> None:
    first, second = np.arange(0.0, 1.01, 0.1), np.arange(9.0, 9.31, 0.1)
    t = np.concatenate([first, [7.0], second])  # a sample alone is no stretch
    expected = np.concatenate([first, second])
    np.testing.assert_allclose(even_times(t, 0.1), expected, atol=1e-12)
    halves = np.arange(0.0, 1.01, 0.05)
    np.testing.assert_allclose(even_times(first, 0.05), halves, atol=1e-12)
    uneven = first + np.tile([0.0, 0.02], 6)[:11]
    np.testing.assert_allclose(even_times(uneven, 0.1), first, atol=1e-12)


EVEN = np.arange(0.0, 20.0, 0.02)
BETWEEN = np.arange(3.0, 17.0, 0.0173)


def wave(t: np.ndarray, hz: float) -> np.ndarray:
    """A wave about a force that rises, (n, 1)."""
    return (np.sin(2 * np.pi * hz * t + 0.3) + 9.8 + 0.1 * t)[:, None]


@pytest.mark.parametrize("hz", [0.2, 3.0, 12.0, 17.0, 21.0])
def test_a_spline_through_even_samples_keeps_what_is_quick(hz: float) -> None:
    found = spline_through(EVEN, wave(EVEN, hz))(BETWEEN)
    np.testing.assert_allclose(found, wave(BETWEEN, hz), atol=1e-3)
    # the derivatives are those of the effects
    change = spline_through(EVEN, wave(EVEN, hz))(BETWEEN, 1)[:, 0]
    turn = 2 * np.pi * hz
    expected = turn * np.cos(turn * BETWEEN + 0.3) + 0.1
    np.testing.assert_allclose(change, expected, atol=5e-3 * turn)


def test_stamps_that_were_rounded_are_even() -> None:
    rounded = np.round(EVEN + 1e-7 * np.arange(len(EVEN)), 6)
    found = spline_through(rounded, wave(EVEN, 21.0))(EVEN[100:900] + 0.01)
    np.testing.assert_allclose(found, wave(EVEN[100:900] + 0.01, 21.0), atol=0.02)
    assert len(spline_through(rounded, wave(EVEN, 3.0)).x) > len(EVEN)


@pytest.mark.parametrize("late", [0.3, 2e-3])
def test_samples_with_a_gap_or_uneven_stamps_have_a_plain_spline(late: float) -> None:
    t = EVEN + late * (EVEN > 9.0) * (np.arange(len(EVEN)) % 2 if late < 0.1 else 1)
    found = spline_through(t, wave(t, 2.0))
    np.testing.assert_array_equal(found.x, t)
    np.testing.assert_allclose(
        found(BETWEEN), CubicSpline(t, wave(t, 2.0))(BETWEEN), rtol=1e-12
    )
