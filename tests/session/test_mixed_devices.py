"""Recordings in which two devices send under the same names."""

import numpy as np
import pytest

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.session.mixed_devices import find_mixed_devices, refuse_mixed_devices

RATE, SECONDS, WINDOWS = 100.0, 20.0, 4
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


def test_two_devices_are_refused_and_told_by_how_much_they_differ() -> None:
    block, windows = recording(by_turns())
    with pytest.raises(InputError, match=r"two devices.*ax by 0\.4 m/s².*gx by 0\.01"):
        refuse_mixed_devices(block, windows)


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
