"""What simulated sensors and clocks do to a motion: delay, filters, mount, stamps."""

import numpy as np
import pytest
from simulated import PLAIN, told

from fieldcal.sim_device import VirtualDevice
from fieldcal.sim_device.profile_file import profile_from_tables
from fieldcal.sim_device.vocabulary import checked_effect, parse


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


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_increments_are_means_in_the_axes_at_an_end_of_the_interval(
    sign: float,
) -> None:
    """To the square of the interval, 60 ms; with the other sign they are undone."""
    quiet = {"sampling": {"rate_hz": 1000.0}, "noise": {"acc": 0.0, "gyr": 0.0}}
    half, coning, seen = sign * 0.03, sign * 3e-4, []
    for given in ({"sculling": half, "coning": coning}, {"sculling": 0.0}):
        device = VirtualDevice(
            profile_from_tables(quiet).having(checked_effect("increments", given))
        )
        device.take(200)
        device.turn(1.0, 0.7, 0.8)
        seen.append(device.take(1000))
    shown, plain = seen
    f, w = plain.acc, plain.gyr
    change = [np.gradient(v, 1e-3, axis=0) for v in (f, w)]
    bend = [np.gradient(v, 1e-3, axis=0) for v in change]
    across = np.cross(w, f)
    square = bend[0] / 2 + np.cross(w, change[0]) - np.cross(change[1], f)
    square += (2.0 if sign > 0 else -1.0) * np.cross(w, across)
    force = half * across + coning * square
    rate = coning * (bend[1] / 2 + np.cross(w, change[1]))
    # what is left goes as the cube, and a turn's ends have no derivatives
    smooth = slice(100, 700)
    for found, first, expected in (
        (shown.acc - f, half * across, force),
        (shown.gyr - w, 0.0 * w, rate),
    ):
        left = np.abs(found - expected)[smooth].max()
        assert left < 0.1 * np.abs(found - first)[smooth].max()


def test_a_skewed_clock_shows_against_the_host() -> None:
    block = VirtualDevice(told("clock_skew:ppm=500"), 2).take(100_000)
    slope = np.polyfit(block.t_host, block.t, 1)[0]
    assert slope - 1 == pytest.approx(500e-6, abs=1e-6)
    np.testing.assert_allclose(np.diff(block.t), 0.01)
    assert (np.diff(block.t_host) >= 0).all() and (
        block.t_host > block.t / 1.0005
    ).all()
