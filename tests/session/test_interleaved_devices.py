"""Two devices by turns that differ by less than their noise, and single ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.session import interleaved_devices
from fieldcal.session.interleaved_devices import (
    LEAST_OUTPUTS,
    find_interleaved_devices,
)
from fieldcal.session.mixed_devices import find_mixed_devices, refuse_mixed_devices
from fieldcal.windows.interleaving import OnePlace

RATE, SECONDS = 100.0, 15.0
EACH = int(RATE * SECONDS)
ATTITUDES = Rotation.random(7, random_state=np.random.default_rng(6))
NOISE = np.repeat([0.02, 1e-3], 3)
G = 9.81

Windows = list[tuple[float, float] | None]


def one_device(seed: int) -> Array:
    """Samples of noise and gravity at rest in each attitude, (n, 6)."""
    force = ATTITUDES.inv().apply([0.0, 0.0, G])
    six = np.repeat(np.hstack([force, np.zeros_like(force)]), EACH, axis=0)
    rng = np.random.default_rng(seed)
    return np.asarray(six + NOISE * rng.standard_normal(six.shape))


def recording(six: Array) -> tuple[Block, Windows]:
    starts = SECONDS * np.arange(len(ATTITUDES))
    ends: Windows = [(float(s) + 0.5, float(s) + SECONDS - 0.5) for s in starts]
    return Block.of(np.arange(len(six)) / RATE, six[:, :3], six[:, 3:]), [*ends, None]


def second(seed: int, angle_deg: float, bias: float = 0.5) -> Array:
    """What another device puts out more than the first: biases, mounting, scales.

    Biases are `bias` standard deviations of a sample.
    """
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(angle_deg * _unit(rng), degrees=True)
    force = ATTITUDES.inv().apply([0.0, 0.0, G])
    more = (turn.apply(force) - force) * (1 + 1e-3 * rng.normal(size=3))
    six = np.hstack([more, np.zeros_like(more)]) + bias * NOISE * rng.normal(size=6)
    return np.repeat(six, EACH, axis=0)


def _unit(rng: np.random.Generator) -> Array:
    axis = rng.normal(size=3)
    return np.asarray(axis / np.linalg.norm(axis))


def places(k: int, late: Array | None = None) -> Array:
    """1 in one place of each period, another in each position; 0 elsewhere."""
    n = len(ATTITUDES) * EACH
    moved = np.arange(len(ATTITUDES)) if late is None else late
    return np.asarray((np.arange(n) + np.repeat(moved, EACH)) % k == 0, float)[:, None]


@pytest.mark.parametrize("k", [2, 3, 5, 9])
def test_two_devices_are_found_that_differ_by_less_than_their_noise(k: int) -> None:
    for seed in range(5):
        six = one_device(seed) + places(k) * second(seed, 0.15)
        block, windows = recording(six)
        assert find_mixed_devices(block, windows) is None, "in no window alone"
        assert find_interleaved_devices(block, windows) is not None, seed


def test_they_are_refused_and_told_by_how_much_they_differ() -> None:
    apart = np.array([0.016, 0, 0, 9e-4, 0, 0]) * np.ones((len(places(2)), 1))
    apart[:, 1] += 2e-3 * one_device(0)[:, 1]
    with pytest.raises(
        InputError,
        match=r"two devices.*by turns.*a[xy] by 0\.01\d m/s² and gx by 0\.000[89]",
    ):
        refuse_mixed_devices(*recording(one_device(1) + places(2) * apart))


def test_half_of_the_samples_in_another_order_hide_less_than_a_second_device() -> None:
    six = one_device(3) + places(2) * second(3, 0.3)
    rng = np.random.default_rng(1)
    at = np.flatnonzero(rng.random(len(six) // 2) < 0.25) * 2
    six[at], six[at + 1] = six[at + 1], six[at].copy()
    assert find_interleaved_devices(*recording(six)) is not None


def test_one_device_is_no_two() -> None:
    for seed in range(20):
        assert find_interleaved_devices(*recording(one_device(seed))) is None
    assert find_interleaved_devices(recording(one_device(0))[0], [None]) is None


@pytest.mark.parametrize("k", [2, 3, 5])
def test_what_does_not_grow_with_the_force_is_of_one_device(k: int) -> None:
    """Such as another task of its program in every k-th sample."""
    for seed in range(10):
        same = NOISE * np.random.default_rng(seed).normal(size=6)
        six = one_device(seed) + places(k) * same
        assert find_interleaved_devices(*recording(six)) is None, seed


@pytest.mark.parametrize("k", [2, 3])
def test_another_disturbance_in_each_position_is_of_one_device(k: int) -> None:
    """No matrix explains it, whatever the signs."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        own = np.repeat(NOISE * rng.normal(size=(len(ATTITUDES), 6)), EACH, axis=0)
        six = one_device(seed) + places(k) * own
        assert find_interleaved_devices(*recording(six)) is None, seed


def test_one_output_is_no_device() -> None:
    six = one_device(5)
    six[:, :1] += places(2) * second(5, 0.5)[:, :1]
    assert find_interleaved_devices(*recording(six)) is None
    six[:, 1:2] += places(2) * second(5, 0.5)[:, 1:2]
    assert find_interleaved_devices(*recording(six)) is not None


def test_dither_of_half_a_step_to_both_sides_is_of_one_device() -> None:
    """The coarser output is, the more of two devices may be such a dither."""
    steps = 4 * NOISE
    six = one_device(7) + places(2) * second(7, 0.15, 1.0)
    coarse = np.round(six / steps) * steps
    assert find_interleaved_devices(*recording(six)) is not None
    assert find_interleaved_devices(*recording(coarse)) is None


def test_few_positions_tell_nothing() -> None:
    """Three differences are explained by some matrix and bias."""
    block, windows = recording(one_device(9) + places(2) * second(9, 0.5, 0.0))
    assert find_interleaved_devices(block, windows) is not None
    assert find_interleaved_devices(block, windows[:3]) is None


def test_gyroscopes_alone_tell_nothing() -> None:
    six = one_device(9) + places(2) * second(9, 0.5, 3.0)
    six[:, 0] = np.nan
    assert find_interleaved_devices(*recording(six)) is None


@pytest.mark.parametrize("k", [2, 7])
def test_what_differs_beyond_chance_may_differ(k: int) -> None:
    """From a little above chance on; an unsteady window tells of none."""
    rng, seen = np.random.default_rng(k), [0, 0]
    for strength in np.linspace(1.0, 8.0, 60):
        size = strength * rng.standard_normal((9, 6))
        found = [OnePlace(one, np.ones(6), True) for one in size]
        differ = (
            np.count_nonzero(interleaved_devices._differ(found, k)) >= LEAST_OUTPUTS
        )
        may = interleaved_devices._may_differ(
            [*found, None, OnePlace(size[0], np.full(6, 1e-9), False)]
        )
        assert may or not differ
        seen[may] += 1
    assert min(seen) > 5
    assert not interleaved_devices._may_differ([None])
