"""Even knots, and cubics between them, against a polynomial and a ramp with a pause."""

from __future__ import annotations

import numpy as np

from fieldcal.model.rows.knots import even_times, hermite_spline


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
