"""Recordings in which two devices send under the same names."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.session.mixed_devices import find_mixed_devices, refuse_mixed_devices
from fieldcal.windows.alternation import alternating_means

RATE, SECONDS, WINDOWS = 100.0, 20.0, 4
LADDER = (0.0, 45.0, -45.0, 20.0, -70.0)
"""Angles that two devices are turned to together, deg."""
APART = np.array([0.4, -0.3, 0.2, 0.01, 0.0, 0.0])


def recording(added: Array) -> tuple[Block, list[tuple[float, float] | None]]:
    """Windows of `SECONDS` at other attitudes, with (n, 6) `added` to the noise."""
    rng = np.random.default_rng(3)
    n = int(RATE * SECONDS)
    t = np.arange(n * WINDOWS) / RATE
    angle = np.deg2rad(20.0) * np.repeat(np.arange(WINDOWS), n)
    acc = 9.81 * np.column_stack([0 * t, -np.cos(angle), np.sin(angle)])
    acc += 0.02 * rng.standard_normal(acc.shape) + added[:, :3]
    gyr = 1e-3 * rng.standard_normal(acc.shape) + added[:, 3:]
    ends = [(i * SECONDS + 1, (i + 1) * SECONDS - 1) for i in range(WINDOWS)]
    return Block.of(t, acc, gyr), [*ends, None]


def by_turns() -> Array:
    """Every other sample is of a device with other biases and scale factors."""
    n = int(RATE * SECONDS * WINDOWS)
    every_other = (np.arange(n) % 2)[:, None]
    grows = 1 + 0.03 * np.arange(n)[:, None] / n
    return np.asarray(every_other * APART * grows)


def hum_of_half_the_rate() -> Array:
    """Mains of 49.99 Hz heard at 100 Hz: the difference of two values varies."""
    t = np.arange(int(RATE * SECONDS * WINDOWS)) / RATE
    return np.asarray(np.sin(2 * np.pi * 49.99 * t + 0.4)[:, None] * APART)


def turned(angle_deg: float, seed: int) -> tuple[Block, list[tuple[float, float]]]:
    """Windows on a ladder, by turns of two devices at an angle to one another.

    Each has biases, scale factors and noise of its own, as the consumer grade has them.
    """
    rng = np.random.default_rng(seed)
    n = int(RATE * SECONDS)
    beta = np.deg2rad(np.repeat(LADDER, n))
    force = 9.81 * np.column_stack([0.1 + 0 * beta, -np.cos(beta), np.sin(beta)])
    axis = rng.normal(size=3)
    away = Rotation.from_rotvec(angle_deg * axis / np.linalg.norm(axis), degrees=True)
    six = []
    for attitude in (Rotation.identity(), away):
        scale = 1 + 0.02 * rng.normal(size=3)
        acc = scale * attitude.apply(force) + 0.2 * rng.normal(size=3)
        gyr = np.zeros_like(acc) + 0.02 * rng.normal(size=3)
        six.append(np.hstack([acc, gyr]))
    mixed = np.where(np.arange(len(beta))[:, None] % 2, *six)
    mixed += np.repeat([0.03, 1e-3], 3) * rng.standard_normal(mixed.shape)
    starts = SECONDS * np.arange(len(LADDER))
    windows = [(float(s) + 1, float(s) + SECONDS - 1) for s in starts]
    return Block.of(np.arange(len(mixed)) / RATE, mixed[:, :3], mixed[:, 3:]), windows


def test_two_devices_are_refused_and_told_by_how_much_they_differ() -> None:
    block, windows = recording(by_turns())
    with pytest.raises(InputError, match=r"two devices.*ax by 0\.4 m/s².*gx by 0\.01"):
        refuse_mixed_devices(block, windows)


@pytest.mark.parametrize("angle_deg", [5.0, 30.0, 90.0, 180.0])
def test_two_devices_at_an_angle_are_refused(angle_deg: float) -> None:
    """What they differ by is another in each window."""
    for seed in range(5):
        block, windows = turned(angle_deg, seed)
        assert find_mixed_devices(block, windows) is not None, seed
        assert find_mixed_devices(block, windows[:2]) is not None, "by the gyroscopes"


def test_two_devices_turned_about_the_vertical_look_alike_in_one_position() -> None:
    """Good ones: their biases are no larger than their noise."""
    rng = np.random.default_rng(2)
    n = int(RATE * SECONDS)
    tilt = np.deg2rad(np.repeat(LADDER, n))
    one = 9.81 * np.column_stack([np.sin(tilt), -np.cos(tilt), 0 * tilt])
    other = one[:, [2, 1, 0]] * [-1, 1, 1]  # a quarter turn about y
    acc = np.where(np.arange(len(tilt))[:, None] % 2, one, other + [1e-3, 0, -1e-3])
    acc += 2e-3 * rng.standard_normal(acc.shape)
    gyr = 3e-5 * rng.standard_normal(acc.shape)
    block = Block.of(np.arange(len(acc)) / RATE, acc, gyr)
    starts = SECONDS * np.arange(len(LADDER))
    windows = [(float(s) + 1, float(s) + SECONDS - 1) for s in starts]
    assert alternating_means(block.between(*windows[0]).six) is None
    assert find_mixed_devices(block, windows) is not None
    assert find_mixed_devices(block, windows[:3]) is None, (
        "two differ, of which any may"
    )


def test_a_vibration_in_some_windows_is_no_second_device() -> None:
    """Where the others stand still, no rotation explains it."""
    n = int(RATE * SECONDS)
    shaken = (-1.0) ** np.arange(n * WINDOWS)[:, None] * APART
    shaken[n : 2 * n] = 0.0
    assert find_mixed_devices(*recording(shaken)) is None


def test_two_accelerometers_at_an_angle_are_told_by_the_rotation() -> None:
    for seed in range(5):
        block, windows = turned(30.0, seed)
        alone = Block.of(block.t, block.acc, np.full_like(block.gyr, np.nan))
        assert find_mixed_devices(alone, windows) is not None, seed
        assert find_mixed_devices(alone, windows[:3]) is None, "three fit any rotation"


def test_a_vibration_of_exactly_half_the_rate_is_no_second_device() -> None:
    """Its direction and size are others in each position, as what carries it is."""
    rng = np.random.default_rng(8)
    n = int(RATE * SECONDS)
    sizes = np.array([0.3, 1.2, 0.5, 2.0])[:, None] * rng.normal(size=(WINDOWS, 6))
    sizes[:, 3:] /= 30.0
    shaken = (-1.0) ** np.arange(n * WINDOWS)[:, None] * np.repeat(sizes, n, axis=0)
    assert find_mixed_devices(*recording(shaken)) is None


def test_a_vibration_is_told_within_a_window() -> None:
    """In these two its phase is the same, so that they differ by the same."""
    t = np.arange(int(RATE * SECONDS * WINDOWS)) / RATE
    slow = np.cos(np.pi * (t - 3.5) / SECONDS)  # steady for the first samples
    shaken = (-1.0) ** np.arange(len(t)) * slow
    block, windows = recording(shaken[:, None] * APART)
    assert find_mixed_devices(block, [windows[0], windows[2]]) is None


def test_a_hum_of_half_the_sampling_rate_is_no_second_device() -> None:
    assert find_mixed_devices(*recording(hum_of_half_the_rate())) is None


def test_one_window_is_not_enough_to_tell_them() -> None:
    block, windows = recording(by_turns())
    assert find_mixed_devices(block, windows[:1]) is None
    assert find_mixed_devices(block, []) is None
    assert find_mixed_devices(block, windows) is not None


def test_one_device_passes() -> None:
    alone = np.zeros((int(RATE * SECONDS * WINDOWS), 6))
    assert find_mixed_devices(*recording(alone)) is None
    refuse_mixed_devices(*recording(alone))
