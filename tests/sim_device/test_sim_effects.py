"""Each effect that can be given, by what it adds: with it less without it, same seed.

Values are worked out by hand for a place with g = 10 m/s^2 and turns whose sine is 0.6
and cosine 0.8, so that the device at rest feels f = 10 (-0.6, -0.64, 0.48).
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fieldcal.core import frames
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.chain import SignalChain
from fieldcal.sim_device.effects import catalogue
from fieldcal.sim_device.profile import (
    ONE,
    ZERO,
    Climate,
    Identity,
    NoiseFigures,
    Sampling,
    Site,
    Truth,
)
from fieldcal.sim_device.profile_file import profile_from_tables
from fieldcal.sim_device.vocabulary import checked_effect, parse

A = float(np.arcsin(0.6))
RATE = (0.1, 0.2, -0.3)
QUIET = NoiseFigures(
    ZERO, ZERO, acc_instability=ZERO, gyr_instability=ZERO, temperature=0.0
)
PLAIN = Profile(
    site=Site(gravity=10.0),
    sampling=Sampling(100.0),
    truth=Truth(ZERO, ONE, ZERO, ONE),
    noise=QUIET,
    temperature=Climate(ramp_k_s=0.01, self_heating_k=0.0),
)


def told(text: str) -> Profile:
    return PLAIN.having(parse(text))


def at_rest(profile: Profile) -> Block:
    """100 s at the turns, the last sample being that of 100 s."""
    device = VirtualDevice(profile, 9)
    device.turn(A, A, 0.05)
    return device.take(10_001)


def turning(profile: Profile) -> Block:
    """The last second of a steady turn at `RATE`."""
    device = VirtualDevice(profile, 9)
    device.take(round(100 * device.spin(RATE, seconds=1.0)))
    return device.take(100)


def added(text: str) -> Array:
    """What the effect adds after 100 s at rest, (6,)."""
    more: Array = at_rest(told(text)).six[-1] - at_rest(PLAIN).six[-1]
    return more


def test_every_effect_of_the_catalogue_can_be_given(shared: Path) -> None:
    text = (shared / "design" / "effects.md").read_text()
    rows = re.findall(r"^\| `(\w+)`.*?\|.*?\|(.*?)\|", text, re.MULTILINE)
    assert rows
    for id_, parameters in rows:
        for name in re.findall(
            r"\b(?:[a-z]+_\w+|ppm|hz|tau_s|axes|unit)\b", parameters
        ):
            assert name in catalogue()[id_].names(), (id_, name)


@pytest.mark.parametrize("id_", catalogue())
def test_every_effect_shows_somewhere(id_: str) -> None:
    example = catalogue()[id_].EXAMPLE
    plain = profile_from_tables({"noise": {"acc": 0.01}, **example.device})
    profile = plain.having(checked_effect(id_, example.given))
    count = 1_000 if example.in_motion else 12_000  # the way is over soon
    with_, without = (
        (lambda d: (d.spin(RATE, (A, A, 0.0), 1.0), d.take(count))[1])(
            VirtualDevice(p, 4)
        )
        for p in (profile, plain)
    )
    if len(with_) == len(without):
        host = with_.t_host - without.t_host
        stamps = with_.t != without.t
        assert (
            np.any(with_.six != without.six)
            or np.any(np.abs(host) > 1e-4)
            or np.any(stamps)
        )


F = 10 * np.array([-0.6, -0.64, 0.48])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("cross_coupling:k12=0.01,k31=0.02", [0.01 * -6.4, 0, 0.02 * -6, 0, 0, 0]),
        ("quadratic:x=1e-3,z=-1e-3", [0.036, 0, -0.02304, 0, 0, 0]),
        ("cubic:y=1e-5", [0, -0.00262144, 0, 0, 0, 0]),
        ("scale_asymmetry:x=0.01,z=0.01", [0.06, 0, 0.048, 0, 0, 0]),
        (
            "pendulous_products:l11=1e-4,l22=1e-4,l33=1e-4",
            [0.00384, -0.003072, -0.00288, 0, 0, 0],
        ),
        ("g_sensitivity:g11=1e-4,g23=1e-4", [0, 0, 0, -6e-4, 4.8e-4, 0]),
        ("g2_sensitivity:x=1e-5", [0, 0, 0, 3.6e-4, 0, 0]),
        ("gravity_error:relative=0.001", [-0.006, -0.0064, 0.0048, 0, 0, 0]),
        ("temperature_bias:ax=0.003,gz=-2e-4", [0.003, 0, 0, 0, 0, -2e-4]),
        ("temperature_scale:y=1e-4", [0, -6.4e-4, 0, 0, 0, 0]),
        ("thermal_hysteresis:az=0.5,gx=0.01", [0, 0, 0.005, 1e-4, 0, 0]),
        (
            "warm_up:ay=0.01,gx=1e-3,tau_s=50",
            [0, 0.01 * np.exp(-2), 0, 1e-3 * np.exp(-2), 0, 0],
        ),
        ("bias_drift:ax=1e-4,gy=1e-6", [0.01, 0, 0, 0, 1e-4, 0]),
        ("bias_step:az=0.02,gz=-1e-3,at_s=60", [0, 0, 0.02, 0, 0, -1e-3]),
        ("hum:ay=0.05,gx=1e-3,hz=50.25,phase_deg=90", [0, 0.05, 0, 1e-3, 0, 0]),
        ("gyro_scale:s3=0.01", [0] * 6),
        ("gyro_cross_coupling:s12=0.01", [0] * 6),
        ("gyro_products:p11=0.1,p22=0.1,p33=0.1", [0] * 6),
        ("lever_arm:x=0.1,z=-0.2", [0] * 6),
        ("time_delay:seconds=0.02", [0] * 6),
        ("bump:at_s=61.7,for_s=0.8", [0] * 6),
    ],
)
def test_what_is_added_at_rest_after_100_s_and_1_k(
    text: str, expected: list[float]
) -> None:
    np.testing.assert_allclose(added(text), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("gyro_cross_coupling:s12=0.01", [0.002, 0, 0]),
        ("gyro_scale:s3=0.01", [0, 0, -0.003]),
        ("gyro_products:p11=0.1,p22=0.1,p33=0.1", [0.002, -0.006, -0.003]),
    ],
)
def test_what_is_added_to_a_steady_rate(text: str, expected: list[float]) -> None:
    more = turning(told(text)).gyr - turning(PLAIN).gyr
    np.testing.assert_allclose(more, np.tile(expected, (100, 1)), atol=1e-12)


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


def test_a_wrong_mounting_and_a_wrong_unit() -> None:
    # procedure x is device +y, procedure y is device -x
    block = at_rest(told("mounting:axes=+y-x+z,unit=g"))
    np.testing.assert_allclose(block.acc[-1], np.array([6.4, -6, 4.8]) / 9.80665)
    np.testing.assert_array_equal(block.gyr[-1], 0)
    spun = turning(PLAIN.having(parse("mounting:axes=+x+y-z,unit=deg/s")))
    np.testing.assert_allclose(spun.gyr[0], np.rad2deg([0.1, 0.2, 0.3]))


def test_settling_fades_from_the_end_of_the_turn() -> None:
    blocks = []
    for profile in (told("settling:ax=-0.03,gy=1e-3,tau_s=4"), PLAIN):
        device = VirtualDevice(profile)
        device.take(500)
        assert device.turn(A, A, 2.0) == 7.0
        blocks.append(device.take(2000).six)
    more = blocks[0] - blocks[1]
    np.testing.assert_allclose(more[0], 0, atol=1e-12)
    np.testing.assert_allclose(more[200], [-0.03, 0, 0, 0, 1e-3, 0], atol=1e-12)
    np.testing.assert_allclose(more[600, 0], -0.03 * np.exp(-1))
    assert np.abs(np.diff(more, axis=0)).max() < 2e-4


def test_a_bias_step_comes_at_its_instant() -> None:
    with_, without = at_rest(told("bias_step:az=0.02,gz=-1e-3,at_s=60")), at_rest(PLAIN)
    more = (with_.six - without.six)[:, 2]
    np.testing.assert_array_equal(with_.t[more != 0][0], 60.0)


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


def test_gyroscopes_that_are_late_show_what_was() -> None:
    moving = []
    for text in ("time_delay:seconds=0.02", "time_delay:seconds=-0.02", ""):
        device = VirtualDevice(PLAIN.having(parse(text)) if text else PLAIN)
        device.turn(1.0, 0.0, 2.0)
        moving.append(device.take(300))
    late, early, plain = moving
    np.testing.assert_array_equal(late.acc, plain.acc)
    np.testing.assert_allclose(late.gyr[2:], plain.gyr[:-2], atol=1e-14)
    np.testing.assert_array_equal(early.gyr, plain.gyr)
    np.testing.assert_allclose(early.acc[2:], plain.acc[:-2], atol=1e-14)


def test_sensors_of_little_bandwidth_show_an_exponential_mean_of_what_was() -> None:
    step, moving = 1e-3, []
    sampling = {"sampling": {"rate_hz": 1 / step}}
    quiet = {**sampling, "noise": {"acc": 0.0, "gyr": 0.0}}
    for given in ({"acc": 0.03, "gyr": 0.08}, {"gyr": 0.08}, {"acc": 0.0}):
        device = VirtualDevice(
            profile_from_tables(quiet).having(checked_effect("bandwidth", given))
        )
        device.take(500)
        device.turn(1.0, 0.4, 0.8)
        moving.append(device.take(1500))
    both, gyr, plain = moving
    np.testing.assert_array_equal(gyr.acc, plain.acc)
    np.testing.assert_array_equal(gyr.gyr, both.gyr)
    for shown, true, tau in (
        (both.acc, plain.acc, 0.03),
        (both.gyr, plain.gyr, 0.08),
    ):
        # trapezoid of tau dy/dt + y = u, begun at rest
        keep, mean = (2 * tau - step) / (2 * tau + step), (true[1:] + true[:-1]) / 2
        expected = true[:1].repeat(len(true), axis=0)
        for i, u in enumerate(mean):
            expected[i + 1] = keep * expected[i] + (1 - keep) * u
        np.testing.assert_allclose(shown, expected, atol=2e-4 * float(np.ptp(true)))


def test_sensors_of_second_order_follow_the_equation_of_butterworth() -> None:
    step, tau, moving = 1e-3, 0.04, []
    quiet = {"sampling": {"rate_hz": 1 / step}, "noise": {"acc": 0.0, "gyr": 0.0}}
    for given in ({"acc": tau, "gyr": tau}, {"gyr": tau}, {"acc": 0.0}):
        device = VirtualDevice(
            profile_from_tables(quiet).having(checked_effect("second_order", given))
        )
        device.take(500)
        device.turn(1.0, 0.4, 0.8)
        moving.append(device.take(1500))
    both, gyr, plain = moving
    np.testing.assert_array_equal(gyr.acc, plain.acc)
    np.testing.assert_array_equal(gyr.gyr, both.gyr)
    for shown, true in ((both.acc, plain.acc), (both.gyr, plain.gyr)):
        # tau^2 y'' + sqrt(2) tau y' + y = u by the rule of midpoints, begun at rest
        y, speed = true[0].copy(), np.zeros(3)
        expected = [y.copy()]
        for u in (true[1:] + true[:-1]) / 2:
            pull = u - y - np.sqrt(2) * tau * speed - step / 2 * speed
            gain = pull * step / (tau**2 + step * tau / np.sqrt(2) + step**2 / 4)
            y, speed = y + step * (speed + gain / 2), speed + gain
            expected.append(y.copy())
        off = np.abs(shown - np.array(expected)).max()
        assert off < 3e-4 * float(np.ptp(true))


def test_stamps_are_off_and_samples_are_not() -> None:
    quiet = {"sampling": {"rate_hz": 1000.0}, "noise": {"acc": 0.0, "gyr": 0.0}}
    seen = []
    for given in ({"step": 0.003}, {"share": 0.0, "step": 0.003}, {"jitter": 0.0}):
        device = VirtualDevice(
            profile_from_tables(quiet).having(checked_effect("stamp_error", given))
        )
        device.take(500)
        device.turn(1.0, 0.4, 0.8)
        seen.append(device.take(800))
    coarse, taken_so, plain = seen
    np.testing.assert_allclose(coarse.t, np.floor(plain.t / 0.003) * 0.003)
    np.testing.assert_array_equal(coarse.six, plain.six)
    # taken when the stamps say: each sample is that of the even one at its stamp
    at = np.rint((taken_so.t - plain.t[0]) * 1000).astype(int)
    inside = at >= 0
    np.testing.assert_allclose(taken_so.six[inside], plain.six[at[inside]], atol=1e-5)


def test_stamps_scatter_by_their_jitter() -> None:
    profile = PLAIN.having(checked_effect("stamp_error", {"jitter": 1e-3}))
    off = VirtualDevice(profile, 3).take(4000).t - VirtualDevice(PLAIN, 3).take(4000).t
    assert np.std(off) == pytest.approx(1e-3, rel=0.05)
    assert abs(np.mean(off)) < 1e-4


def test_a_mount_follows_the_equation_of_its_mode() -> None:
    step, b, damping = 5e-4, 4e-4, 0.3
    quiet = {"sampling": {"rate_hz": 1 / step}, "noise": {"acc": 0.0, "gyr": 0.0}}
    moving = []
    for given in ({"y": b, "damping": damping}, {"y": 0.0}):
        profile = profile_from_tables(quiet).having(
            checked_effect("flexible_mount", given)
        )
        device = VirtualDevice(profile)
        device.take(800)
        device.turn(1.0, 0.4, 0.4)
        moving.append(device.take(2500))
    shown, plain = moving
    np.testing.assert_array_equal(shown.gyr, plain.gyr)
    np.testing.assert_array_equal(shown.acc[:, [0, 2]], plain.acc[:, [0, 2]])
    # b y'' + 2 d sqrt(b) y' + y = u + 2 d sqrt(b) u' by the rule of midpoints
    u, root = plain.acc[:, 1], np.sqrt(b)
    change = np.gradient(u, step)
    y, speed, expected = u[0], 0.0, [u[0]]
    for k in range(len(u) - 1):
        pull = (u[k] + u[k + 1]) / 2 + damping * root * (change[k] + change[k + 1])
        ahead = pull - y - step / 2 * speed - 2 * damping * root * speed
        gain = ahead * step / (b + damping * root * step + step**2 / 4)
        y, speed = y + step * (speed + gain / 2), speed + gain
        expected.append(y)
    made = np.abs(shown.acc - plain.acc).max()
    assert np.abs(shown.acc[:, 1] - expected).max() < 0.01 * made and made > 0.1


def test_increments_turn_force_and_rate_by_what_the_interval_turns() -> None:
    quiet = {"sampling": {"rate_hz": 1000.0}, "noise": {"acc": 0.0, "gyr": 0.0}}
    seen = []
    for given in ({"sculling": 0.004, "coning": 0.01}, {"sculling": 0.0}):
        device = VirtualDevice(
            profile_from_tables(quiet).having(checked_effect("increments", given))
        )
        device.take(200)
        device.turn(1.0, 0.7, 0.8)
        seen.append(device.take(1000))
    shown, plain = seen
    more = shown.six - plain.six
    inside = slice(5, -5)
    change = np.gradient(plain.gyr, 1e-3, axis=0)
    expected = 0.004 * np.cross(plain.gyr, plain.acc)
    np.testing.assert_allclose(more[:, :3], expected, atol=1e-5)
    coning = 0.01 * np.cross(plain.gyr, change)
    np.testing.assert_allclose(more[inside, 3:], coning[inside], atol=1e-4)
    assert np.abs(coning).max() > 5e-4


def test_vibration_is_rectified_by_its_variance() -> None:
    def shaken(x: float) -> Array:
        effect = parse(f"vibration_rectification:x={x},level=0.5")
        device = VirtualDevice(PLAIN.having(effect), 3)
        levels = []
        for _ in range(20):
            device.turn(0, 0, 0.01)
            device.take(2)
            levels.append(device.take(500).acc[:, 0])
        return np.array(levels)

    plain, rectified = shaken(1e-12), shaken(0.01)
    scatter = plain.std(axis=1)
    assert scatter.max() < 0.55 and scatter.max() > 3 * scatter.min()
    shift = (rectified - plain).mean(axis=1)
    np.testing.assert_allclose(shift, 0.01 * (plain**2).mean(axis=1), rtol=1e-6)


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


def test_a_skewed_clock_shows_against_the_host() -> None:
    block = VirtualDevice(told("clock_skew:ppm=500"), 2).take(100_000)
    slope = np.polyfit(block.t_host, block.t, 1)[0]
    assert slope - 1 == pytest.approx(500e-6, abs=1e-6)
    np.testing.assert_allclose(np.diff(block.t), 0.01)
    assert (np.diff(block.t_host) >= 0).all() and (
        block.t_host > block.t / 1.0005
    ).all()


def test_noise_is_louder_where_it_is_said() -> None:
    profile = replace(PLAIN, noise=replace(QUIET, acc=(0.01,) * 3, gyr=(0.001,) * 3))
    loud = profile.having(parse("noise_level:channel=ay,ratio=3"))
    ratio = VirtualDevice(loud, 1).take(500).six.std(axis=0) / (
        VirtualDevice(profile, 1).take(500).six.std(axis=0)
    )
    np.testing.assert_allclose(ratio, [1, 3, 1, 1, 1, 1], rtol=1e-9)


def passed(text: str, row: list[float], channel: int = 0) -> list[float]:
    """What becomes of a channel's values in the signal chain, 1 s apart."""
    x = np.zeros((6, len(row)))
    x[channel] = row
    chain = SignalChain(PLAIN.having(parse(text)), 0)
    got: list[float] = chain.passes(np.arange(len(row), dtype=float), x)[
        channel
    ].tolist()
    return got


def test_the_signal_chain() -> None:
    assert passed("quantisation:acc=0.25", [0.1, 0.13, -0.4]) == [0, 0.25, -0.5]
    assert passed("quantisation:acc=0.25", [0.1], channel=3) == [0.1]
    assert passed("quantisation:gyr=0.5", [0.4], channel=5) == [0.5]
    assert passed("saturation:channel=acc,limit=5", [7, -7, 3]) == [5, -5, 3]
    assert passed("saturation:channel=gz,limit=5", [7], channel=5) == [5]
    stuck = "stuck:channel=ax,from_s=1,to_s=4"
    assert passed(stuck, [1, 2, 3, 4, 5]) == [1, 2, 2, 2, 5]
    assert passed("mounting:unit=mrad/s", [0.5], channel=4) == [500]


def test_the_full_scale_of_the_device_clips() -> None:
    profile = replace(PLAIN, range=replace(PLAIN.range, acceleration=6.0))
    np.testing.assert_allclose(at_rest(profile).acc[-1], [-6, -6, 4.8])


def test_wrongly_decoded_words() -> None:
    def decoded(kind: str, words: list[float]) -> list[float]:
        return passed(f"decode_fault:channel=ax,kind={kind},full_scale=32768", words)

    assert decoded("low_byte_signed", [100, 200, -100, 256]) == [100, -56, -356, 256]
    assert decoded("bytes_swapped", [0x0102, 1, -2]) == [0x0201, 256, -257]
    assert decoded("wrapped", [32767, 32768, -32769]) == [32767, -32768, 32767]
    # +-16 g: 200 words
    lsb = 16 * 9.80665 / 32768
    plain = passed("decode_fault:channel=ax,kind=low_byte_signed", [200 * lsb])
    assert plain == pytest.approx([-56 * lsb])
    at_home = "decode_fault:channel=ay,kind=wrapped"
    assert passed(at_home, [-10.0], channel=1) == pytest.approx([6.0])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("voodoo:x=1", "no effect is called 'voodoo'; the device knows angle_off"),
        ("quadratic:w=1", "quadratic has no parameter 'w'; it takes x, y, z"),
        ("quadratic", "needs at least one of x, y, z"),
        ("hum:ax=1", "hum needs hz"),
        ("hum:ax=1,hz=0", "hz must be above 0"),
        ("hum:ax=1,hz=nan", "hz must be a number"),
        ("hum:ax=one,hz=5", "ax must be a number, not 'one'"),
        ("hum:ax=1,hz", "is not PARAMETER=VALUE"),
        ("hum:ax=1,ax=2,hz=1", "gives ax twice"),
        ("stuck:from_s=1,to_s=2", "stuck needs channel"),
        ("stuck:channel=bx,from_s=1,to_s=2", "channel must be ax"),
        ("mounting:axes=xyz", "axes must be like"),
        ("mounting:axes=+x+x+y", "not three signed axes"),
        ("dropped:fraction=1", "below 1"),
        ("heading_error:psi_deg=3", "Earth's rate only"),
        ("earth_rate:x=1", "it takes no parameter"),
    ],
)
def test_what_cannot_be_given_is_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        VirtualDevice(PLAIN.having(parse(text)))


def test_only_what_can_happen_twice_is_given_twice() -> None:
    two = PLAIN.having(parse("hum:ax=1,hz=5"), parse("hum:ax=1,hz=6"))
    assert [e.id for e in two.effects] == ["hum", "hum"]
    with pytest.raises(InputError, match="quadratic is given twice"):
        PLAIN.having(parse("quadratic:x=1"), parse("quadratic:y=1"))
