"""Turns against rotations built another way, and the misprints of the paper."""

import doctest

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fieldcal.core import frames, gravity
from fieldcal.core.errors import InputError

angle = st.floats(-3.1, 3.1)


@given(angle, angle)
def test_turns_are_right_handed_rotations_about_z_then_x(a: float, b: float) -> None:
    # a frame turned by +a sees vectors turned by -a
    seen = Rotation.from_euler("zx", [-a, 0]) * Rotation.identity()
    seen = Rotation.from_euler("x", -b) * seen
    np.testing.assert_allclose(frames.turn(a, b), seen.as_matrix(), atol=1e-12)


def test_third_line_of_5_has_a_plus_sign() -> None:
    a, b, g = np.deg2rad(30), np.deg2rad(5), 9.81
    expected = [-g * np.sin(a), -g * np.cos(a) * np.cos(b), g * np.cos(a) * np.sin(b)]
    np.testing.assert_allclose(frames.force(a, b, g), expected)


def test_earth_rate_at_home_and_turned() -> None:
    phi, a, b = np.deg2rad([50.0, 30.0, 5.0])
    omega = frames.EARTH_RATE
    home = frames.earth_rate_home(phi)
    np.testing.assert_allclose(home, [0, -omega * np.sin(phi), omega * np.cos(phi)])
    third = omega * (np.sin(phi) * np.cos(a) * np.sin(b) + np.cos(phi) * np.cos(b))
    np.testing.assert_allclose((frames.turn(a, b) @ home)[2], third)


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.1, 20))
def test_angles_are_read_back_from_the_force(a: float, b: float, g: float) -> None:
    np.testing.assert_allclose(
        frames.angles_of(frames.force(a, b, g)), [a, b], atol=1e-6
    )


@pytest.mark.parametrize("axes", [["+x", "+y"], ["x", "y", "q"], ["+y", "+x", "+z"]])
def test_a_mounting_that_is_none_is_refused(axes: list[str]) -> None:
    with pytest.raises(InputError, match="mounting"):
        frames.mounting_matrix(axes)


@pytest.mark.parametrize("phi", [0.0, 45.0, -90.0])
def test_gravity_against_the_published_values_of_the_ellipsoid(phi: float) -> None:
    published = {0.0: 9.7803253359, 45.0: 9.806198, -90.0: 9.8321849378}
    assert gravity.gravity(phi) == pytest.approx(published[phi], abs=1e-6)


def test_gravity_falls_with_height_by_the_free_air_gradient() -> None:
    fall = gravity.gravity(45, 1000) - gravity.gravity(45)
    assert fall == pytest.approx(-3.085e-3, abs=2e-6)
    with pytest.raises(InputError, match="latitude"):
        gravity.gravity(95)


def test_examples() -> None:
    for module in (frames, gravity):
        failed, tried = doctest.testmod(module, extraglobs={"np": np})
        assert tried and not failed
