"""Turns against rotations built another way, and the misprints of the paper."""

import doctest
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fieldcal.core import frames
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array

angle = st.floats(-3.1, 3.1)


def turned(a: float, b: float) -> Array:
    """What a frame sees that is turned by a about z, then by b about its x."""
    # a frame turned by +a sees vectors turned by -a
    seen = Rotation.from_euler("x", -b) * Rotation.from_euler("z", -a)
    return np.asarray(seen.as_matrix())


@given(angle, angle)
def test_turns_are_right_handed_rotations_about_z_then_x(a: float, b: float) -> None:
    np.testing.assert_allclose(frames.direction_cosines(a, b), turned(a, b), atol=1e-12)


def test_angles_are_read_back_from_three_turns_also_where_beta_is_a_right_angle() -> (
    None
):
    for alpha, beta, gamma in itertools.product((-3.0, 0.0, 0.7), (-1.2, 0.4), (2, -1)):
        back = frames.angles_of_direction_cosines(
            frames.direction_cosines(alpha, beta, gamma)
        )
        np.testing.assert_allclose(back, [alpha, beta, gamma], atol=1e-12)
    for alpha, beta in itertools.product((-2.5, 0.3, 2.0), (-np.pi / 2, np.pi / 2)):
        back = frames.angles_of_direction_cosines(frames.direction_cosines(alpha, beta))
        np.testing.assert_allclose(back, [alpha, beta, 0.0], atol=1e-12)
        # the third turn is about the same axis, and goes into the first
        one = frames.direction_cosines(alpha, beta, 0.4)
        again = frames.angles_of_direction_cosines(one)
        assert again[2] == 0.0
        np.testing.assert_allclose(frames.direction_cosines(*again), one, atol=1e-12)


def test_many_turns_at_once_are_the_single_ones() -> None:
    alpha, beta = [[0], [1], [-2]], [0, 2]
    every = frames.direction_cosines(alpha, beta)
    assert every.shape == (3, 2, 3, 3)
    for (i, (a,)), (j, b) in itertools.product(enumerate(alpha), enumerate(beta)):
        np.testing.assert_allclose(every[i, j], turned(a, b), atol=1e-12)


def test_third_line_of_5_has_a_plus_sign() -> None:
    a, b, g = np.deg2rad(30), np.deg2rad(5), 9.81
    expected = [-g * np.sin(a), -g * np.cos(a) * np.cos(b), g * np.cos(a) * np.sin(b)]
    np.testing.assert_allclose(frames.specific_force_at_rest(a, b, g), expected)


def test_forces_of_many_turns_are_rows() -> None:
    found = frames.specific_force_at_rest([0.0, 0.5], 0.1, 9.81)
    assert found.shape == (2, 3)
    expected = [turned(a, 0.1) @ [0, -9.81, 0] for a in (0.0, 0.5)]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_earth_rate_at_home_and_turned() -> None:
    phi, a, b = np.deg2rad([50.0, 30.0, 5.0])
    omega = frames.EARTH_RATE
    home = frames.earth_rate_at_home(phi)
    np.testing.assert_allclose(home, [0, -omega * np.sin(phi), omega * np.cos(phi)])
    third = omega * (np.sin(phi) * np.cos(a) * np.sin(b) + np.cos(phi) * np.cos(b))
    np.testing.assert_allclose((frames.direction_cosines(a, b) @ home)[2], third)


def test_earth_turns_once_in_a_sidereal_day() -> None:
    day = 23 * 3600 + 56 * 60 + 4.09
    assert 2 * np.pi / frames.EARTH_RATE == pytest.approx(day, abs=0.02)
    speed = np.linalg.norm(frames.earth_rate_at_home(0.7))
    assert speed == pytest.approx(frames.EARTH_RATE)


@given(angle, st.floats(-1.5, 1.5), st.floats(0.1, 20))
def test_angles_are_read_back_from_the_force(a: float, b: float, g: float) -> None:
    seen = frames.angles_of_force_direction(g * turned(a, b) @ [0, -1, 0])
    if abs(np.cos(a)) < 1e-5:
        # along the axis of the second turn no force tells of it
        assert abs(seen[0]) == pytest.approx(np.pi / 2, abs=2e-5)
        return
    # alpha beyond a right angle is read as it is, beta stays within one
    np.testing.assert_allclose(turned(*seen), turned(a, b), atol=1e-6)


@pytest.mark.parametrize(
    ("along", "expected"),
    [
        ((0, 0, 1), (0, 90)),
        ((0, -1, 0), (0, 0)),
        ((0, 1, 0), (180, 0)),
        ((-1, 0, 0), (90, 0)),
        ((1, 0, 0), (-90, 0)),
        ((0, 1, 1), (180, -45)),
        ((0, 1, -1), (180, 45)),
        ((0, -1, -1), (0, -45)),
    ],
)
def test_angles_of_the_faces_and_edges(
    along: tuple[float, float, float], expected: tuple[float, float]
) -> None:
    alpha, beta = np.rad2deg(frames.angles_of_force_direction(along))
    assert beta == pytest.approx(expected[1])
    assert (alpha - expected[0]) % 360 == pytest.approx(0.0, abs=1e-9)


def test_of_another_rate_only_what_lies_along_the_turn_lasts() -> None:
    """The mean over a whole turn, by turning in small steps."""
    rates = np.array([[0.3, -0.2, 0.6], [0, 0, 0], [0, 0, 1e-3], [-5, 0, 0]])
    found = frames.axis_projections(rates)
    for rate, left in zip(rates, found, strict=True):
        speed = np.linalg.norm(rate)
        axis = rate / speed if speed else rate
        steps = np.arange(360)[:, None] * np.deg2rad(1) * axis
        mean = Rotation.from_rotvec(steps).as_matrix().mean(axis=0)
        np.testing.assert_allclose(left, mean, atol=1e-12)


@pytest.mark.parametrize(
    ("axes", "device", "procedure"),
    [
        (["+x", "-z", "+y"], [1, 2, 3], [1, -3, 2]),
        (["x", "y", "z"], [1, 2, 3], [1, 2, 3]),
        (["-y", "x", "z"], [1, 2, 3], [-2, 1, 3]),
        (["z", "x", "+y"], [1, 2, 3], [3, 1, 2]),
    ],
)
def test_a_mounting_names_the_device_axis_along_each_procedure_axis(
    axes: list[str], device: list[float], procedure: list[float]
) -> None:
    np.testing.assert_array_equal(frames.mounting_matrix(axes) @ device, procedure)


@pytest.mark.parametrize(
    "axes", [["+x", "+y"], ["x", "y", "q"], ["x", "y", "z", "x"], ["xx", "y", "z"]]
)
def test_a_mounting_that_names_no_axes_is_refused(axes: list[str]) -> None:
    with pytest.raises(InputError) as told:
        frames.mounting_matrix(axes)
    assert str(told.value) == (
        f'mounting {axes} is not three signed axes such as ["+x", "-z", "+y"]'
    )


@pytest.mark.parametrize(
    "axes", [["+y", "+x", "+z"], ["x", "x", "y"], ["x", "y", "-z"]]
)
def test_a_mounting_that_is_no_right_handed_frame_is_refused(axes: list[str]) -> None:
    with pytest.raises(InputError) as told:
        frames.mounting_matrix(axes)
    assert str(told.value).startswith(f"mounting {axes} is not a right-handed frame: ")
    assert "name each axis once, and check the signs against" in str(told.value)


@given(angle, angle, angle)
def test_a_third_turn_is_about_the_y_that_both_have_turned(
    a: float, b: float, c: float
) -> None:
    third = Rotation.from_euler("y", -c).as_matrix()
    expected = third @ turned(a, b)
    np.testing.assert_allclose(frames.direction_cosines(a, b, c), expected, atol=1e-12)
    vector = np.array([0.3, -9.7, 1.1])
    found = frames.in_procedure_axes(np.array(a), np.array(b), vector, c)
    np.testing.assert_allclose(found, expected @ vector, atol=1e-12)
    two = frames.in_procedure_axes(np.array(a), np.array(b), vector)
    np.testing.assert_allclose(two, turned(a, b) @ vector, atol=1e-12)


def test_angles_of_single_precision_are_turned_in_double() -> None:
    single = np.array([0.3, -0.2, 1.1], dtype=np.float32)
    double = single.astype(float)
    np.testing.assert_allclose(
        frames.direction_cosines(*single), frames.direction_cosines(*double), rtol=1e-14
    )
    np.testing.assert_allclose(
        frames.angles_of_force_direction(single),
        frames.angles_of_force_direction(double), rtol=1e-14,
    )  # fmt: skip
    matrix = turned(0.3, -0.2).astype(np.float32)
    np.testing.assert_allclose(
        frames.angles_of_direction_cosines(matrix),
        frames.angles_of_direction_cosines(matrix.astype(float)), rtol=1e-14,
    )  # fmt: skip


@given(st.floats(-1e4, 1e4), st.sampled_from([360.0, 2 * np.pi]))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(
    one: float, turn: float
) -> None:
    wrapped = frames.wrap_angle(np.array([one]), turn)[0]
    assert -turn / 2 <= wrapped <= turn / 2
    turns = (one - wrapped) / turn
    assert turns == pytest.approx(round(turns), abs=1e-9)


def test_angles_are_wrapped_in_rad_unless_a_turn_is_given() -> None:
    found = frames.wrap_angle(np.array([4.0, -4.0, 1.0]))
    np.testing.assert_allclose(found, [4 - 2 * np.pi, 2 * np.pi - 4, 1.0])


def test_the_shortest_rotation_leads_from_one_attitude_to_the_other() -> None:
    """In axes of the device, which turn with it."""
    before = frames.direction_cosines(0.4, -0.3)
    alpha, beta = np.array([0.4, 1.9, -2.8]), np.array([-0.3, 0.2, 1.1])
    found = frames.shortest_rotation(before, alpha, beta)
    for vector, a, b in zip(found, alpha, beta, strict=True):
        after = Rotation.from_rotvec(-vector).as_matrix() @ before
        np.testing.assert_allclose(after, turned(a, b), atol=1e-12)
        assert np.linalg.norm(vector) <= np.pi


def test_examples() -> None:
    failed, tried = doctest.testmod(frames, extraglobs={"np": np})
    assert tried and not failed
