"""What the simulated fixture does: base, joints, Earth's rate, sway and knocks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulated import PLAIN, A, F, added, at_rest, told

from fieldcal.core import frames
from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.profile import (
    Identity,
)
from fieldcal.sim_device.vocabulary import parse


def test_the_base_is_tilted_before_the_joints_turn() -> None:
    tilt = frames.direction_cosines(np.deg2rad(-3), np.deg2rad(2))
    expected = (
        frames.direction_cosines(A, A) @ tilt @ frames.specific_force_at_home(10.0)
    )
    np.testing.assert_allclose(
        at_rest(told("base_tilt:about_x_deg=2,about_z_deg=-3")).acc[-1], expected
    )


def test_offsets_and_scales_of_the_joints_move_their_angles() -> None:
    offset = frames.specific_force_at_rest(A + np.deg2rad(1), A - np.deg2rad(2), 10.0)
    np.testing.assert_allclose(
        at_rest(told("angle_offset:alpha0_deg=1,beta0_deg=-2")).acc[-1], offset
    )
    scaled = frames.specific_force_at_rest(A * 1.01, A * 0.98, 10.0)
    np.testing.assert_allclose(
        at_rest(told("angle_scale:alpha=0.01,beta=-0.02")).acc[-1], scaled
    )
    home = VirtualDevice(told("angle_offset:alpha0_deg=1,beta0_deg=-2")).take(1).acc[0]
    np.testing.assert_allclose(
        home,
        frames.specific_force_at_rest(np.deg2rad(1), np.deg2rad(-2), 10.0),
        atol=1e-12,
    )


def test_angles_are_set_a_little_off_every_time() -> None:
    device = VirtualDevice(told("angle_setting:sigma_deg=0.3"), 1)
    found = []
    for _ in range(300):
        device.turn(A, A, 0.02)
        device.take(3)
        found.append(frames.angles_of_force_direction(device.take(1).acc[0]))
    off = np.rad2deg(np.array(found) - A)
    assert np.abs(off.mean(axis=0)).max() < 4 * 0.3 / np.sqrt(300)
    np.testing.assert_allclose(off.std(axis=0), 0.3, rtol=0.15)


def test_the_earth_rate_and_a_heading_error() -> None:
    latitude = np.deg2rad(PLAIN.site.latitude_deg)
    felt = frames.direction_cosines(A, A) @ frames.earth_rate_at_home(latitude)
    np.testing.assert_allclose(added("earth_rate:")[3:], felt, atol=1e-15)
    psi = np.deg2rad(30)
    base = frames.EARTH_RATE * np.array(
        [
            np.cos(latitude) * np.sin(psi),
            -np.sin(latitude),
            np.cos(latitude) * np.cos(psi),
        ]
    )
    plain = replace(PLAIN, device=Identity(grade="navigation"))
    turned = at_rest(plain.having(parse("heading_error:psi_deg=30")))
    np.testing.assert_allclose(
        turned.gyr[-1], frames.direction_cosines(A, A) @ base, atol=1e-15
    )
    np.testing.assert_allclose(turned.acc[-1], F)


def test_sway_is_a_line_in_the_force_and_in_quadrature_in_the_rate() -> None:
    effect = parse("sway:amplitude_deg=0.5,hz=0.2,azimuth_deg=0,phase_deg=30")
    block = VirtualDevice(PLAIN.having(effect)).take(1000)
    pulse, x = 0.4 * np.pi, np.deg2rad(0.5)
    angle = x * np.sin(pulse * block.t + np.pi / 6)
    rate = x * pulse * np.cos(pulse * block.t + np.pi / 6)
    zero = np.zeros(1000)
    f = np.stack([zero, -10 * np.cos(angle), 10 * np.sin(angle)], axis=1)
    np.testing.assert_allclose(block.acc, f, atol=1e-12)
    np.testing.assert_allclose(block.gyr, np.stack([rate, zero, zero], 1), atol=1e-12)


def test_a_base_that_is_knocked_stays_as_it_then_stands() -> None:
    knocked = told("base_step:about_x_deg=0.3,about_z_deg=-0.4,at_s=60")
    more = at_rest(knocked).six - at_rest(PLAIN).six
    tilt = np.deg2rad(0.5) * np.array([0.6, 0.0, -0.8])
    # the base turns by the tilt: what does not move in space goes by the other way
    up = np.array([0.0, -10.0, 0.0])
    held = frames.direction_cosines(np.array([A]), np.array([A]))[0]
    goes = held @ (up - np.cross(tilt, up)) - held @ up
    after = more[6100:, :3]
    np.testing.assert_allclose(after, np.tile(goes, (len(after), 1)), atol=5e-4)
    assert not more[:6000].any() and not more[6100:, 3:].any()
    turned = more[:, 3:].sum(axis=0) / 100  # at 100 Hz
    np.testing.assert_allclose(turned, held @ tilt, atol=1e-5)


def test_a_device_that_slips_feels_its_own_turn_and_stays_so() -> None:
    """By a rotation matrix; gyroscopes measure the same turn."""
    given = {"about_x_deg": 3.0, "about_y_deg": 1.0, "about_z_deg": -2.0}
    words = ",".join(f"{name}={value}" for name, value in given.items())
    slipped = at_rest(told(f"mount_slip:{words},at_s=60")).six
    before = at_rest(PLAIN).six
    slip = np.deg2rad(list(given.values()))
    turned = Rotation.from_rotvec(slip).inv().apply(before[6100:, :3])
    np.testing.assert_allclose(slipped[6100:, :3], turned, atol=1e-9)
    assert np.abs(slipped - before)[:6000].max() < 1e-12
    assert np.abs((slipped - before)[6100:, 3:]).max() < 1e-12
    seen = (slipped - before)[:, 3:].sum(axis=0) / 100  # at 100 Hz
    np.testing.assert_allclose(seen, slip, atol=1e-5)


def test_joints_that_creep_go_too_far_and_come_back() -> None:
    """By where the device is held: gyroscopes and accelerometers tell the same."""
    crept = told("joint_creep:alpha_deg=0.3,beta_deg=-0.2,tau_s=5")
    step, seen = 0.01, []
    for profile in (crept, PLAIN):
        device = VirtualDevice(profile, 9)
        device.take(100)
        for alpha, beta in ((A, 0.0), (A, A), (0.0, A)):
            device.turn(alpha, beta, 2.0)
            seen.append(device.take(1000))
    more = [a.six - b.six for a, b in zip(seen[:3], seen[3:], strict=True)]
    far = np.deg2rad([[0.3, 0.0], [0.0, -0.2], [-0.3, 0.0]])
    for k, (alpha, beta) in enumerate(((A, 0.0), (A, A), (0.0, A))):
        for at in (300, 700):  # samples since the turn began, which took 2 s
            since = step * at - 2.0 + 10.0 * np.arange(k, -1, -1)
            there = (far[: k + 1] * np.exp(-since / 5.0)[:, None]).sum(axis=0)
            up = np.array([0.0, -10.0, 0.0])
            held, goes = (
                frames.direction_cosines(alpha + s * there[0], beta + s * there[1]) @ up
                for s in (0, 1)
            )
            np.testing.assert_allclose(more[k][at, :3], goes - held, atol=1e-6)
    turned = np.linalg.norm(step * more[0][:, 3:].sum(axis=0))
    assert turned == pytest.approx(np.deg2rad(0.3) * np.exp(-8.0 / 5.0), rel=0.01)


def test_a_bump_is_a_push_without_velocity_and_leaves_the_device_where_it_was() -> None:
    with_, without = at_rest(told("bump:at_s=61.7,for_s=0.8")), at_rest(PLAIN)
    more = with_.six - without.six
    when = with_.t[np.abs(more).max(axis=1) > 1e-9]
    assert 61.7 <= when.min() < 61.73 and 62.47 < when.max() < 62.5
    assert np.abs(more[:, :3]).max() > 1.5
    tilt_only = told("bump:at_s=61.7,for_s=0.8").effects[0]
    still = parse("bump:at_s=61.7,for_s=0.8,tilt_deg=0")
    assert tilt_only["tilt_deg"] == 0.5
    pushed = at_rest(PLAIN.having(still)).acc - without.acc
    assert np.linalg.norm(pushed, axis=1).max() == pytest.approx(2.0, rel=1e-3)
    np.testing.assert_allclose(pushed.sum(axis=0) / 100, 0, atol=1e-3)
