"""Noise of each window, and lines that shake some of them."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model.rows.vibration import (
    measure_window_noise,
    quiet_window_noise,
    without_lines,
)

RATE = 200.0
WHITE = np.repeat([1e-2, 1e-4], 3)
N = 2000
WINDOWS = np.array([[i * N, (i + 1) * N] for i in range(5)])


def six_of(seed: int = 1) -> Array:
    noise: Array = WHITE * np.random.default_rng(seed).standard_normal((5 * N, 6))
    return noise + [0.0, -9.8, 0.0, 0.0, 0.0, 0.0]


def block_of(six: Array) -> Block:
    return Block.of(np.arange(len(six)) / RATE, six[:, :3], six[:, 3:])


def line(hz: float, size: Array, window: int) -> Array:
    """A sine in one window."""
    t = np.arange(5 * N) / RATE
    inside = np.arange(5 * N) // N == window
    out: Array = np.outer(inside * np.sin(2 * np.pi * hz * t + 0.7), size)
    return out


def test_windows_alike_have_the_usual_noise() -> None:
    found = measure_window_noise(block_of(six_of()), WINDOWS, RATE)
    np.testing.assert_allclose(found.noise, WHITE, rtol=0.1)
    np.testing.assert_array_equal(found.levels, np.tile(found.noise, (5, 1)))
    np.testing.assert_allclose(found.variance, np.tile(found.noise[:3] ** 2, (5, 1)))


@pytest.mark.parametrize("hz", [17.3, 41.0])
def test_a_line_in_a_window_is_taken_out_and_its_shaking_kept(hz: float) -> None:
    size = np.array([0.3, 0.1, 0.0, 0.0, 2e-3, 0.0])
    plain = six_of()
    found = measure_window_noise(block_of(plain + line(hz, size, 2)), WINDOWS, RATE)
    np.testing.assert_allclose(found.noise, WHITE, rtol=0.1)
    left = found.block.six - plain
    assert np.abs(left[:, :3]).max() < 3e-3 and np.abs(left[:, 3:]).max() < 3e-5
    assert not left[2 * N :][N:].any() and not left[: 2 * N].any()
    expected = size[:3] ** 2 / 2 + WHITE[:3] ** 2
    np.testing.assert_allclose(found.variance[2], expected, rtol=0.1)
    np.testing.assert_allclose(found.variance[[0, 1, 3, 4]],
                               np.tile(found.noise[:3] ** 2, (4, 1)))  # fmt: skip
    np.testing.assert_allclose(found.levels[2], WHITE, rtol=0.15)
    assert (found.levels >= found.noise - 1e-15).all()


def test_a_window_of_more_noise_has_more() -> None:
    six = six_of()
    rng = np.random.default_rng(9)
    six[3 * N : 4 * N, 0] += 0.03 * rng.standard_normal(N)
    found = measure_window_noise(block_of(six), WINDOWS, RATE)
    assert found.levels[3, 0] == pytest.approx(np.hypot(0.01, 0.03), rel=0.1)
    np.testing.assert_allclose(found.levels[3, 1:], found.noise[1:], rtol=0.1)
    np.testing.assert_array_equal(found.levels[0], found.noise)
    assert found.variance[3, 0] == pytest.approx(0.03**2 + 0.01**2, rel=0.15)
    noise = quiet_window_noise(block_of(six), WINDOWS, RATE)
    np.testing.assert_array_equal(noise.white, found.noise)
    np.testing.assert_allclose(noise.quick, WHITE, rtol=0.1)


@pytest.mark.parametrize(("share", "loud"), [(0.1, False), (0.25, True)])
def test_how_much_louder_counts_depends_on_the_samples(
    share: float, loud: bool
) -> None:
    """Six standard errors of 2000 samples are 13 per cent."""
    six = six_of()
    six[3 * N : 4 * N, 4] *= 1.0 + share
    found = measure_window_noise(block_of(six), WINDOWS, RATE)
    assert (found.levels[3, 4] > found.noise[4] * 1.01) == loud


def test_one_step_of_coarse_outputs_makes_no_window_loud() -> None:
    six = six_of()
    six[:, 2] = 0.1
    six[3 * N + 5 : 3 * N + 9, 2] = 0.2
    found = measure_window_noise(block_of(six), WINDOWS, RATE)
    np.testing.assert_allclose(found.noise[2], 0.1 / 12**0.5)
    np.testing.assert_allclose(found.levels[:, 2], 0.1 / 12**0.5)


T = np.arange(1600) / 100.0


def several(*hz: float) -> Array:
    total = sum(np.sin(2 * np.pi * f * T + f) for f in hz)
    return np.outer(total, [1.0, -2.0, 0.0]) + [5.0, 0.0, -9.0]


@pytest.mark.parametrize("standing", [1, 3, 4])
def test_an_output_on_its_rail_tells_nothing_of_the_noise(standing: int) -> None:
    six = six_of()
    six[: standing * N, 0] = 19.6
    found = measure_window_noise(block_of(np.round(six, 5)), WINDOWS, RATE)
    np.testing.assert_allclose(found.noise, WHITE, rtol=0.1)
    assert (found.levels[:, 0] > 0.9 * WHITE[0]).all()


@pytest.mark.parametrize("hz", [(3.37,), (7.77, 20.01, 33.3), (2.5, 49.0)])
def test_lines_are_fitted_at_their_frequencies(hz: tuple[float, ...]) -> None:
    noise = 1e-3 * np.random.default_rng(5).standard_normal((1600, 3))
    left = without_lines(several(*hz) + noise, 100.0)
    assert np.abs(left - noise - [5.0, 0.0, -9.0]).max() < 4e-3


@pytest.mark.parametrize(("hz", "goes"), [(1.6, False), (2.4, True)])
def test_what_is_slow_stays(hz: float, goes: bool) -> None:
    noise = 1e-3 * np.random.default_rng(5).standard_normal((1600, 3))
    left = without_lines(1e-3 * several(hz) + noise, 100.0) - noise
    assert (left[:, 0].std() < 2e-4) == goes


def test_noise_has_no_line() -> None:
    piece = np.random.default_rng(6).standard_normal((1600, 3))
    np.testing.assert_array_equal(without_lines(piece, 100.0), piece)


def test_samples_that_are_missing_do_not_hide_a_line() -> None:
    noise = 1e-3 * np.random.default_rng(5).standard_normal((1600, 3))
    piece = several(7.77) + noise
    piece[[100, 101, 900], 1] = np.nan
    left = without_lines(piece, 100.0)
    known = np.isfinite(piece)
    assert np.abs((left - noise - [5.0, 0.0, -9.0])[known]).max() < 0.05
    few = piece[:63]
    np.testing.assert_array_equal(without_lines(few, 100.0), few)
    assert np.ptp(without_lines(several(7.77)[:200], 100.0)) < 20.0


def test_outputs_that_are_loud_do_not_spoil_a_line_of_others() -> None:
    """Of amplitude, phase and frequency of a line by its own noise, and of no unit."""
    sigma = np.array([1.0, 0.3, 1e-4])
    noise = sigma * np.random.default_rng(5).standard_normal((1600, 3))
    line = np.outer(np.sin(2 * np.pi * 7.77 * T + 0.4), [0.0, 0.0, 2e-3])
    off = without_lines(line + noise, 100.0) - noise
    # a sine that three numbers fit has the error of three, and one more for the mean
    assert np.sqrt((off[:, 2] ** 2).mean()) < 3e-4 * np.sqrt(4 / 1600)
    unit = np.array([1e-3, 1e3, 1e6])
    other = without_lines((line + noise) * unit, 100.0) / unit - noise
    np.testing.assert_allclose(other[:, 2], off[:, 2], atol=1e-8)


def test_the_usual_noise_is_that_of_the_quieter_quarter() -> None:
    """Of four windows the quietest, though the other three are alike."""
    six = six_of()[: 4 * N]
    six[N:, :3] += 0.02 * np.random.default_rng(8).standard_normal((3 * N, 3))
    found = quiet_window_noise(block_of(six), WINDOWS[:4], RATE)
    np.testing.assert_allclose(found.white, WHITE, rtol=0.15)


def test_of_an_output_without_samples_no_noise_is_known() -> None:
    """Not even that of rounding, though all of its samples lie on a grid."""
    six = six_of()
    step = 0.3 * WHITE
    six = np.round(six / step) * step
    six[:, 4] = np.nan
    found = quiet_window_noise(block_of(six), WINDOWS, RATE)
    assert np.isnan(found.white[4]) and np.isnan(found.quick[4])
    others = [0, 1, 2, 3, 5]
    np.testing.assert_allclose(found.white[others], WHITE[others], rtol=0.1)
