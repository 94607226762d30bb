"""Swaying told by the force alone, against a device that is turned exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.windows.sway_by_force import lean_angles, with_turn_rates
from fieldcal.windows.sway_waves import SwayWaves

FORCE = np.array([1.0, -9.0, 4.0])


def test_a_lean_is_what_the_device_was_turned_by_about_level_axes() -> None:
    """To first order; what turns about the force does not change it."""
    rng = np.random.default_rng(2)
    turned = rng.normal(0.0, 1e-5, (30, 3))
    turned -= turned.mean(axis=0)
    felt = Rotation.from_rotvec(turned).inv().apply(FORCE)
    up = FORCE / np.linalg.norm(FORCE)
    level = turned - np.outer(turned @ up, up)
    found = lean_angles(felt + [0.3, -0.2, 0.1], FORCE)
    np.testing.assert_allclose(found, level, atol=1e-9)
    assert np.abs(level).max() > 1e-5


def test_rates_are_the_derivatives_of_the_angles() -> None:
    """Of each wave; gyroscopes that are not there measure no noise."""
    rng, hz = np.random.default_rng(3), np.array([0.13, 0.31])
    cos, sin = rng.normal(0.0, 0.02, (2, 2, 3))
    waves = SwayWaves(
        hz, 5.0, cos, sin, FORCE, np.zeros(3), np.array([1.0, 2.0, 3.0]),
        np.array([4.0, 5.0, 6.0]), 0.1, (0.0, 10.0),
    )  # fmt: skip
    found = with_turn_rates(waves)
    t, step = np.linspace(0.0, 10.0, 23), 1e-4
    parts = [lean_angles(waves.linear(t + s) - waves.linear(t), FORCE)
             for s in (step, -step)]  # fmt: skip
    # each about its own mean, which the derivative has as well
    rate = (parts[0] - parts[1]) / (2 * step)
    own = found.linear(t)[:, 3:]
    np.testing.assert_allclose(own - own.mean(axis=0), rate, atol=1e-6)
    assert np.abs(own).max() > 1e-3
    np.testing.assert_allclose(found.turn_angle(t, 1), own, atol=1e-12)
    np.testing.assert_array_equal(found.linear(t)[:, :3], waves.linear(t))
    np.testing.assert_array_equal(found.excess_variance, [1, 2, 3, 0, 0, 0])
    assert found.noise[:3] == pytest.approx([4, 5, 6])
    assert np.isnan(found.noise[3:]).all()
