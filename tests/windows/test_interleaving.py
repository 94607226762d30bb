"""What one sample in every k differs by, and single devices that show no such place."""

import numpy as np
import pytest
from scipy.signal import lfilter

from fieldcal.core.samples import Array
from fieldcal.windows.interleaving import (
    PERIODS,
    OnePlace,
    RestOutputs,
    one_place_of_period,
)

N = 2000
NOISE = np.array([0.02, 0.03, 0.02, 1e-3, 1e-3, 2e-3])
APART = NOISE * [0.5, -0.4, 0.3, 0.0, 0.6, -0.5]
CLEAR = 6.0
"""Errors that noise of 10 places and 6 outputs stays below, of some hundred draws."""


def noise(seed: int, n: int = N) -> Array:
    rng = np.random.default_rng(seed)
    return np.asarray(NOISE * rng.standard_normal((n, 6)) + [0, -9.6, 0.3, 0, 0.1, 0])


def place_in(six: Array, period: int) -> OnePlace | None:
    return one_place_of_period(RestOutputs.of(six), period)


def every(k: int, late: int = 0) -> Array:
    return np.asarray(np.arange(N) % k == late, float)[:, None]


@pytest.mark.parametrize("k", [2, 3, 4, 9])
def test_a_difference_below_the_noise_is_measured_with_its_error(k: int) -> None:
    pulls = []
    for seed in range(60):
        found = place_in(noise(seed) + every(k, seed % k) * 2 * APART, k)
        assert found is not None and found.steady
        sign = np.sign(found.size @ APART) if k == 2 else 1.0
        pulls.append((sign * found.size - 2 * APART) / found.error)
    assert np.mean(pulls) == pytest.approx(0.0, abs=0.2)
    assert np.std(pulls) == pytest.approx(1.0, abs=0.15)


def test_the_error_is_that_of_the_difference_of_two_means() -> None:
    for k in (2, 5):
        found = [place_in(noise(seed) + every(k) * APART, k) for seed in (1, 2)]
        expected = NOISE * np.sqrt(k / (1 - 1 / k) / N)
        for one in found:
            assert one is not None
            assert one.error == pytest.approx(expected, rel=0.5)


def test_samples_in_the_wrong_order_now_and_then_leave_most_of_it() -> None:
    rng = np.random.default_rng(4)
    order = np.arange(N)
    at = np.flatnonzero(rng.random(N // 2) < 0.2) * 2
    order[at], order[at + 1] = order[at + 1], order[at].copy()
    found = place_in((noise(3) + every(2) * 3 * APART)[order], 2)
    assert found is not None and found.steady
    assert np.abs(found.size[0]) == pytest.approx(3 * 0.6 * APART[0], rel=0.15)


LOW = lfilter([0.05], [1, -0.95], noise(7), axis=0)
T = np.arange(N)[:, None]
SINGLE = {
    "noise": noise(1),
    "filtered": LOW,
    "sampled twice": np.repeat(noise(2), 2, axis=0)[:N],
    "every other one between two": np.where(
        T % 2 == 0, noise(3), (noise(3) + np.roll(noise(3), 1, axis=0)) / 2
    ),
    "differentiated": np.diff(noise(4, N + 1), axis=0),
    "random telegraph": noise(5)
    + np.cumprod(np.where(np.random.default_rng(1).random((N, 1)) < 0.1, -1, 1), 0)
    * 5 * NOISE,
    "dithered": np.round(noise(6) / NOISE / 5) * NOISE * 5,
    "warming up": noise(8) + T / N * 50 * NOISE,
    "hum beside a half of the rate": noise(9) + np.cos(3.12 * T) * 20 * NOISE,
    "hum of a quarter of the rate": noise(10) + np.cos(np.pi / 2 * T) * NOISE * 3,
    "constant": np.ones((N, 6)),
}  # fmt: skip


@pytest.mark.parametrize("what", SINGLE)
def test_one_device_has_no_such_place(what: str) -> None:
    for k in PERIODS:
        found = place_in(SINGLE[what], k)
        assert found is not None
        assert not found.steady or np.abs(found.t).max() < CLEAR, k


def test_a_course_through_all_places_is_none_of_one_place() -> None:
    """A line of an eighth of the rate, which is steady."""
    line = np.cos(np.pi / 4 * T) * NOISE * 3
    found = place_in(noise(11) + line, 8)
    assert found is not None and (found.size == 0).all() and (found.t == 0).all()
    there = place_in(noise(11) + every(8) * NOISE * 3, 8)
    assert there is not None and np.abs(there.t).min() > CLEAR


def test_a_hum_that_runs_on_is_not_steady() -> None:
    """Of a half of the rate less 1/8 of a turn in the window."""
    hum = np.cos(np.pi * (1 - 0.25 / N) * T + 1.2) * NOISE * 2
    found = place_in(noise(12) + hum, 2)
    assert found is not None and not found.steady


def test_outputs_without_values_and_windows_without_samples() -> None:
    six = noise(13) + every(2) * 3 * APART
    six[:, 3:] = np.nan
    six[::100] = np.nan
    six[1::100] = np.nan
    found = place_in(six, 2)
    assert found is not None
    assert (found.t[3:] == 0).all() and np.abs(found.t[:3]).min() > CLEAR
    for few in (0, 1, 45):
        assert place_in(six[:few], 2) is None
    assert place_in(np.full((N, 6), np.nan), 2) is None


def test_a_hum_that_turns_by_whole_periods_from_piece_to_piece_is_seen_as_one() -> None:
    """What windows of a finite length let through of it is as large in all of them."""
    length = N // (3 * 24) * 3  # of a piece of places of 3
    for turns in (3, 5):
        hum = np.cos(2 * np.pi * (1 / 3 + turns / length) * T + 0.4) * NOISE * 1000
        found = place_in(noise(14) + hum, 3)
        assert found is not None
        assert not found.steady or np.abs(found.t).max() < CLEAR
