"""What turns from an instant on, against whole rotations of what is felt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.frames import earth_rate_at_home
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.physics.attitude_step import AttitudeStep, at_rest_in_known_position
from fieldcal.physics.experience import Experience

NAMES = pytest.mark.parametrize("name", ["mount_slip", "base_step"])
ANGLES_DEG = np.array([3.0, -2.0, 4.0])
SHARE = np.r_[0.0, 0.0, 0.3, 1.0, 1.0, 1.0]
"""Part of each row, one second about its instant, that is after 2.2 s."""


def effect(name: str) -> tuple[AttitudeStep, Array]:
    """One of the catalogue, and the whole of its angles, deg."""
    found = catalogue()[name]
    assert isinstance(found, AttitudeStep)
    return found, ANGLES_DEG[: len(found.params)]


def rows() -> Experience:
    """Six positions on the turning Earth; a table turns the device in the last."""
    alpha, beta = np.random.default_rng(5).uniform(-1.5, 1.5, (2, 6))
    rate = np.zeros((6, 3))
    rate[5] = [0.1, 0.2, -0.3]
    return Experience.at_rest(
        alpha, beta, 9.81, base_rate=1e3 * earth_rate_at_home(0.9),
        rate=rate, lasts=np.ones(6),
    )  # fmt: skip


def turned(x: Experience, name: str, values: Array) -> Array:
    """Change of force and rate if the device turns by the whole angles, (n, 6)."""
    based = name == "base_step"  # about the level axes of the base, in device axes
    axes: Array = x.to_device[:, :, [0, 2]] if based else np.tile(np.eye(3), (6, 1, 1))
    back = Rotation.from_rotvec(np.deg2rad(axes @ values)).inv()
    out = np.hstack([back.apply(x.f) - x.f, back.apply(x.w) - x.w])
    if based:
        out[5, 3:] = 0.0  # the table that turns the device is tilted with the base
    return out


@NAMES
def test_force_and_rate_turn_by_the_whole_angle_after_the_instant(name: str) -> None:
    x, (one, values) = rows(), effect(name)
    found = one.change_of_outputs(x, values, {"at_s": 2.2})
    expected = SHARE[:, None] * turned(x, name, values)
    assert np.abs(expected[3:5]).min() > 1e-6
    np.testing.assert_allclose(found, expected, atol=1e-9)


@NAMES
def test_the_design_is_what_a_small_angle_does(name: str) -> None:
    x, (one, values) = rows(), effect(name)
    small = 1e-4 * values
    by_degrees = one.design(x, {"at_s": 2.2}) @ values
    differences = turned(x, name, small) - turned(x, name, -small)
    expected = SHARE[:, None] * differences / 2e-4
    np.testing.assert_allclose(by_degrees, expected, atol=1e-8)


@NAMES
def test_two_known_positions_tell_it_from_another_bias(name: str) -> None:
    x, (one, _) = rows(), effect(name)
    two = replace(x, position=np.array([-1, 0, 0, 0, 4, 5]))
    assert at_rest_in_known_position(two).tolist() == [False, *[True] * 5]
    assert one.applies(two)
    two.alpha[4], two.beta[5] = np.nan, np.nan
    assert at_rest_in_known_position(two).tolist() == [False, *[True] * 3, *[False] * 2]
    assert not one.applies(two)
    two.alpha[4] = 0.0
    assert one.applies(two)


@NAMES
def test_it_is_looked_for_at_any_instant_of_device_time(name: str) -> None:
    """Device time may begin anywhere; what is left of it shows over time."""
    one, _ = effect(name)
    (shape,) = one.shapes
    assert (shape.kind, shape.unit, shape.low, shape.high) == (
        "instant", "s", -np.inf, np.inf
    )  # fmt: skip
    assert one.seen_in == "time"
    assert one.turns_device == (name == "base_step")  # in space, not in its mount
