"""Outputs of waves, against an attitude that is rotated exactly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array
from fieldcal.windows.sway_waves import SwayWaves

FORCE, ARM = np.array([1.0, -9.0, 4.0]), np.array([0.5, 2.0, -1.0])
HZ, MIDDLE = np.array([0.13, 0.31]), 107.0
PULSE = 2 * np.pi * HZ[:, None]
COS, SIN = np.random.default_rng(4).normal(0.0, 0.02, (2, 2, 3))
"""Amplitudes of the rotation, rad."""

T: Array = MIDDLE + np.linspace(-9.0, 8.0, 40)


def waves_of(size: float = 1.0) -> SwayWaves:
    """The rotation's waves as gyroscopes show them; accelerometers show others."""
    cos, sin = np.full((2, 6), 7.0), np.full((2, 6), -3.0)
    cos[:, 3:] = size * PULSE * SIN
    sin[:, 3:] = -size * PULSE * COS
    zero = np.zeros(6)
    return SwayWaves(HZ, MIDDLE, cos, sin, FORCE, ARM, zero, zero, 0.1,
                     (MIDDLE - 9.0, MIDDLE + 8.0))  # fmt: skip


def angle(t: Array, size: float = 1.0) -> Array:
    """Rotation vector at instants (n,), (n, 3) rad."""
    phase = np.multiply.outer(t - MIDDLE, 2 * np.pi * HZ)
    return size * np.asarray(np.cos(phase) @ COS + np.sin(phase) @ SIN)


def test_the_rotation_is_that_whose_rate_the_gyroscopes_show() -> None:
    waves, step = waves_of(), 1e-4
    np.testing.assert_allclose(waves.turn_angle(T), angle(T), atol=1e-12)
    rate = (angle(T + step) - angle(T - step)) / (2 * step)
    np.testing.assert_allclose(waves.turn_angle(T, 1), rate, atol=1e-8)
    speeding = (angle(T + step) + angle(T - step) - 2 * angle(T)) / step**2
    np.testing.assert_allclose(waves.turn_angle(T, 2), speeding, atol=1e-6)


def exact(size: float) -> Array:
    """Outputs of a device on an arm that is rotated so, less those at rest, (n, 6)."""
    step = 1e-3
    early, now, late = (
        Rotation.from_rotvec(angle(T + s, size)) for s in (-step, 0.0, step)
    )
    places = [held.apply(ARM) for held in (early, now, late)]
    pushed = (places[0] - 2 * places[1] + places[2]) / step**2
    force = now.inv().apply(FORCE + pushed) - FORCE
    rate = (early.inv() * late).as_rotvec() / (2 * step)
    return np.hstack([force, rate])


def test_squares_are_what_a_rotation_and_its_reverse_have_in_common() -> None:
    """The angular acceleration of second order, whose mean is zero, is left out."""
    waves, size = waves_of(), 0.1
    common = (exact(size) + exact(-size)) / 2 / size**2
    step = 1e-4
    ends = (T - step, T + step)
    coned = [-np.cross(waves.turn_angle(t), waves.turn_angle(t, 1)) / 2 for t in ends]
    common[:, :3] -= np.cross((coned[1] - coned[0]) / (2 * step), ARM)
    found = waves.second_order(T)
    scale = np.abs(found).max(axis=0)
    np.testing.assert_allclose(found / scale, common / scale, atol=2e-3)
    np.testing.assert_allclose(waves.outputs(T), found + waves.linear(T))


def test_waves_of_the_outputs_are_cosines_and_sines_about_the_middle() -> None:
    waves = waves_of()
    phase = 2 * np.pi * HZ * (T[:, None] - MIDDLE)
    for c in range(6):
        expected = [
            sum(waves.cos[k, c] * np.cos(p[k]) + waves.sin[k, c] * np.sin(p[k])
                for k in range(2))
            for p in phase
        ]  # fmt: skip
        np.testing.assert_allclose(waves.linear(T)[:, c], expected)


def test_one_wave_has_its_own_mean_frequency_and_periods() -> None:
    """Of five seconds at 0.3 Hz one and a half; its mean squares over whole periods."""
    size = np.deg2rad(2.0)
    cos = np.zeros((1, 6))
    cos[0, 4] = size * 2 * np.pi * 0.3
    one = replace(waves_of(), hz=np.array([0.3]), cos=cos, sin=0 * cos,
                  span=(MIDDLE, MIDDLE + 5.0))  # fmt: skip
    turned, rate = one.mean_squares
    assert turned == pytest.approx(size**2 / 2, rel=5e-3)
    assert rate == pytest.approx((2 * np.pi * 0.3 * size) ** 2 / 2, rel=5e-3)
    assert one.mean_hz == pytest.approx(0.3, rel=5e-3)
    assert one.periods == pytest.approx(1.5, rel=5e-3)
