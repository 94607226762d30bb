"""The virtual device's motion against truths worked out another way."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fieldcal.core import frames, gravity
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.sim_device import Profile, VirtualDevice, earth
from fieldcal.sim_device.joints import Joints
from fieldcal.sim_device.motion import BaseMotion
from fieldcal.sim_device.profile import (
    ONE,
    ZERO,
    Climate,
    Identity,
    MountingAxes,
    NoiseFigures,
    Sampling,
    Truth,
)
from fieldcal.sim_device.vocabulary import parse

PERFECT = Profile(
    truth=Truth(ZERO, ONE, ZERO, ONE),
    noise=NoiseFigures(
        ZERO,
        ZERO,
        acc_instability=ZERO,
        gyr_instability=ZERO,
        temperature=0.0,
    ),
    temperature=Climate(self_heating_k=0.0),
    sampling=Sampling(1000.0),
)
angle = st.floats(-3.0, 3.0)
ALPHA, BETA = np.deg2rad([33.0, -12.0])


def device(*effects: str, profile: Profile = PERFECT) -> VirtualDevice:
    return VirtualDevice(profile.having(*map(parse, effects)))


def turned(*effects: str, profile: Profile = PERFECT) -> tuple[Block, Block]:
    """Samples of a turn to (ALPHA, BETA), and 100 at rest behind it."""
    virtual = device(*effects, profile=profile)
    end = virtual.turn(ALPHA, BETA)
    moving = virtual.take(round(end * virtual.rate) + 1)
    return moving, virtual.take(100)


def followed(gyr: Array, rate: float) -> Rotation:
    """Attitude of the last sample in the axes of the first, from rates alone."""
    mean = (gyr[1:] + gyr[:-1]) / 2
    total = Rotation.identity()
    for w in mean:
        total = total * Rotation.from_rotvec(w / rate)
    return total


@given(angle, angle)
def test_at_rest_it_feels_gravity_where_the_turns_have_put_it(
    a: float, b: float
) -> None:
    virtual = device()
    virtual.turn(a, b, 0.01)
    virtual.take(20)
    expected = frames.specific_force_at_rest(a, b, virtual.profile.gravity)
    np.testing.assert_allclose(virtual.take(2).acc[0], expected, atol=1e-12)


def test_the_rate_felt_in_a_turn_adds_up_to_the_turn() -> None:
    moving, _ = turned()
    there = frames.direction_cosines(ALPHA, BETA)
    assert np.abs(moving.gyr).max() > 0.2
    np.testing.assert_allclose(
        followed(moving.gyr, 1000.0).as_matrix().T, there, atol=1e-7
    )


def test_a_third_angle_turns_about_the_twice_turned_y() -> None:
    virtual, gamma = device(), np.deg2rad(70.0)
    end = virtual.turn(ALPHA, BETA, gamma=gamma)
    moving = virtual.take(round(end * virtual.rate) + 1)
    there = Rotation.from_euler("ZXY", [ALPHA, BETA, gamma])
    got = followed(moving.gyr, 1000.0)
    assert (got.inv() * there).magnitude() < 1e-7
    up = there.inv().apply([0.0, -virtual.profile.gravity, 0.0])
    np.testing.assert_allclose(virtual.take(2).acc[0], up, atol=1e-9)


def test_the_rate_felt_while_base_and_joints_move_adds_up_too() -> None:
    virtual = device("sway:amplitude_deg=2,hz=0.7", "base_tilt:about_x_deg=20")
    frame = virtual.body.frame(np.array([0.0, 3.0]))
    virtual.turn(ALPHA, BETA)
    moving = virtual.take(3001)
    first, last = virtual.body.frame(np.array([0.0, 3.0])).q.T
    np.testing.assert_allclose(frame.q[:, 0], first)
    expected = (
        Rotation.from_quat(first, scalar_first=True).inv()
        * Rotation.from_quat(last, scalar_first=True)
    )  # fmt: skip
    got = followed(moving.gyr, 1000.0)
    assert (got.inv() * expected).magnitude() < 1e-6


@pytest.mark.parametrize(
    "text",
    [
        "sway:amplitude_deg=1,hz=0.7,phase_deg=17,azimuth_deg=57",
        "bump:at_s=1,for_s=0.6,tilt_deg=1",
    ],
)
def test_rates_of_the_rocking_base_are_derivatives_of_its_angle(text: str) -> None:
    t = np.arange(0.9, 1.8, 1e-4)
    move = parse(text).base_motion()
    assert isinstance(move, BaseMotion)
    angle = move.angle(t)
    assert np.abs(angle.x).max() == pytest.approx(np.deg2rad(1), rel=0.01)
    rate = np.gradient(angle.x, t)
    acceleration = np.gradient(angle.rate, t)
    np.testing.assert_allclose(angle.rate[1:-1], rate[1:-1], atol=1e-5)
    np.testing.assert_allclose(angle.acceleration[1:-1], acceleration[1:-1], atol=1e-3)


def test_a_device_with_a_fast_clock_turns_when_its_clock_says() -> None:
    virtual = device("clock_skew:ppm=50000")
    virtual.take(1000)
    assert virtual.turn(1.0, 0.0, 2.0) == pytest.approx(1.0 + 2.0 * 1.05)
    assert virtual.busy_until == pytest.approx(3.1)
    block = virtual.take(4000)
    moving = block.t[np.abs(block.gyr[:, 2]) > 1e-12]
    assert moving[0] == pytest.approx(1.0, abs=0.01)
    assert moving[-1] == pytest.approx(3.1, abs=0.01)
    assert virtual.spin((0, 1.0, 0), seconds=2.0, at=6.0) == pytest.approx(8.1)
    assert virtual.bump(seconds=1.0) == pytest.approx(5.0 + 1.05)


def test_a_turn_starts_and_ends_at_rest_and_peaks_at_15_8_of_its_mean_rate() -> None:
    virtual = device()
    assert virtual.turn(1.0, 0.0, 2.0) == 2.0
    gyr = virtual.take(2500).gyr[:, 2]
    np.testing.assert_allclose(gyr[[0, 2000, 2400]], 0, atol=1e-12)
    assert gyr.max() == pytest.approx(15 / 8 * 0.5)


def test_a_turn_between_two_samples_is_a_jump() -> None:
    virtual = device()
    virtual.take(3)
    virtual.turn(ALPHA, BETA, 0.0004, at=0.0052)
    block = virtual.take(10)
    assert not block.gyr.any()
    np.testing.assert_allclose(block.acc[2], [0, -PERFECT.gravity, 0], atol=1e-12)
    expected = frames.specific_force_at_rest(ALPHA, BETA, PERFECT.gravity)
    np.testing.assert_allclose(block.acc[3], expected, atol=1e-12)


def test_a_turn_told_in_a_turn_follows_it() -> None:
    virtual = device()
    assert virtual.turn(1.0, 0.0, 2.0) == 2.0
    virtual.take(500)
    assert virtual.turn(0.0, 0.0, 1.0) == 3.0
    assert virtual.busy_until == 3.0
    block = virtual.take(3000)
    np.testing.assert_allclose(np.abs(np.diff(block.gyr, axis=0)).max(), 0, atol=7e-3)
    np.testing.assert_allclose(block.acc[-1, 0], 0, atol=1e-12)


@pytest.mark.parametrize("names", [("+x", "+y", "+z"), ("-z", "+x", "-y")])
def test_lever_arm_is_the_acceleration_of_where_the_sensors_are(
    names: tuple[str, str, str],
) -> None:
    profile = replace(PERFECT, frame=MountingAxes(names))
    to_procedure = frames.mounting_matrix(names)
    arm = to_procedure @ [0.3, -0.2, 0.1]
    plain, _ = turned(profile=profile)
    levered, _ = turned("lever_arm:x=0.3,y=-0.2,z=0.1", profile=profile)
    virtual = device(profile=profile)
    virtual.turn(ALPHA, BETA)
    t = plain.t
    attitude = Rotation.from_quat(virtual.body.frame(t).q.T, scalar_first=True)
    place = attitude.apply(arm)
    acceleration = np.gradient(np.gradient(place, t, axis=0), t, axis=0)
    expected = attitude.inv().apply(acceleration)
    got = (levered.acc - plain.acc) @ to_procedure.T
    assert np.abs(got).max() > 0.05
    np.testing.assert_allclose(got[3:-3], expected[3:-3], atol=2e-6)


def test_mounting_shows_the_axis_that_was_named() -> None:
    profile = Profile(
        truth=PERFECT.truth,
        noise=PERFECT.noise,
        frame=MountingAxes(("+x", "-z", "+y")),
    )
    _, still = turned(profile=profile)
    axes = frames.mounting_matrix(["+x", "-z", "+y"])
    expected = frames.specific_force_at_rest(ALPHA, BETA, profile.gravity) @ axes
    np.testing.assert_allclose(still.acc[0], expected, atol=1e-12)
    home = VirtualDevice(profile).take(1).acc[0]
    np.testing.assert_allclose(home, [0, 0, profile.gravity], atol=1e-12)


def test_a_navigation_device_feels_the_earth_turn_in_any_position() -> None:
    profile = Profile(
        device=Identity(grade="navigation"), truth=PERFECT.truth, noise=PERFECT.noise
    )
    _, still = turned(profile=profile)
    latitude = np.deg2rad(profile.site.latitude_deg)
    expected = frames.direction_cosines(ALPHA, BETA) @ frames.earth_rate_at_home(
        latitude
    )
    np.testing.assert_allclose(still.gyr[0], expected, atol=1e-15)
    _, tactical = turned()
    assert not tactical.gyr[0].any()


def test_a_rate_table_turns_steadily_and_comes_home() -> None:
    virtual = device()
    rate = (0.0, 0.4, 0.3)
    ready = virtual.spin(rate, seconds=2.0)
    virtual.take(round(ready * 1000))
    steady = virtual.take(1000)
    np.testing.assert_allclose(steady.gyr, np.tile(rate, (1000, 1)), atol=1e-12)
    other = virtual.spin((0.0, -0.4, 0.3), seconds=6.0)
    virtual.take(round((other - virtual.time) * 1000) + 1)
    np.testing.assert_allclose(virtual.take(1).gyr, [[0, -0.4, 0.3]], atol=1e-12)
    home = virtual.turn(0.0, 0.0)
    virtual.take(round((home - virtual.time) * 1000) + 1)
    np.testing.assert_allclose(
        virtual.take(1).six[0], [0, -PERFECT.gravity, 0, 0, 0, 0], atol=1e-9
    )


def test_rates_meet_where_segments_of_the_motion_meet() -> None:
    joints = Joints((0.1, 0.2, -0.7))
    joints.spin(1.0, 4.0, (0.3, -0.4, 0.8), (0.0, 0.0, 0.5))
    joints.spin(9.0, 4.0, (0.3, -0.4, 0.8), (0.2, 0.0, 0.5))
    joints.turn(20.0, 3.0, (0.0, 0.0, 0.1))
    for seam in (1.0, 5.0, 9.0, 11.0, 13.0, 20.0, 23.0):
        swing = joints.at(np.array([seam - 1e-7, seam]))
        np.testing.assert_allclose(np.diff(swing.rate), 0, atol=1e-6)
        np.testing.assert_allclose(np.diff(swing.acceleration), 0, atol=1e-5)
        np.testing.assert_allclose(np.diff(swing.angle), 0, atol=1e-6)


@pytest.mark.parametrize("latitude", [-90.0, -30.0, 0.0, 45.0, 71.2])
@pytest.mark.parametrize("height", [-400.0, 0.0, 5000.0])
def test_gravity_agrees_with_the_series_of_the_core(
    latitude: float, height: float
) -> None:
    assert earth.gravity(latitude, height) == pytest.approx(
        gravity.normal_gravity(latitude, height), abs=1e-6
    )


def test_a_place_off_the_earth_is_refused() -> None:
    with pytest.raises(InputError, match="latitude is -90 to 90"):
        earth.gravity(91, 0)


@pytest.mark.parametrize("seconds", [0.0, -1.0, np.inf, np.nan])
def test_a_turn_without_a_duration_is_refused(seconds: float) -> None:
    with pytest.raises(InputError, match="more than 0 s"):
        device().turn(0, 0, seconds)


def test_a_turn_to_no_angle_is_refused() -> None:
    with pytest.raises(InputError, match="must be numbers"):
        device().turn(np.nan, 0)
