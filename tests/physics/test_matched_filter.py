"""The amplitude of a push against least squares, and its chances against draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from fieldcal.core.samples import Array
from fieldcal.physics.matched_filter import (
    AmplitudeNoise,
    MatchedFilter,
    amplitude_noise,
)

ONE = np.eye(6)


def least_squares_height(z: Array, width: int) -> tuple[float, float]:
    """Height of a half sine amid twice its length, with a line; and its sigma."""
    x = np.arange(len(z)) - (len(z) - 1) / 2
    inside = np.abs(x) < width / 2
    wave = np.where(inside, np.cos(np.pi * x / width), 0.0)
    design = np.column_stack([wave, np.ones(len(z)), x])
    covariance = np.linalg.inv(design.T @ design)
    return float((covariance @ design.T @ z)[0]), float(np.sqrt(covariance[0, 0]))


@pytest.mark.parametrize("width", [4, 12, 120])
def test_an_amplitude_is_that_of_least_squares_over_its_sigma(width: int) -> None:
    rng = np.random.default_rng(width)
    z = rng.standard_normal((2 * width, 6))
    matched = MatchedFilter.for_length(width)
    found = matched.amplitudes(z)
    assert found.shape == (1, 6)
    for c in range(6):
        height, sigma = least_squares_height(z[:, c], width)
        # blocks of a twelfth of the push take its shape to some percent
        near = 1e-9 if width <= 12 else 0.25
        assert found[0, c] == pytest.approx(height / sigma, abs=near)
        assert matched.sigma == pytest.approx(sigma, rel=0.02)


@pytest.mark.parametrize("width", [5, 40, 130])
def test_the_stretch_of_an_amplitude_is_where_the_push_was(width: int) -> None:
    z = np.zeros((20 * width, 6))
    wave = np.sin(np.pi * (np.arange(width) + 0.5) / width)
    z[7 * width : 8 * width, 4] = wave
    matched = MatchedFilter.for_length(width)
    amplitudes = matched.amplitudes(z)[:, 4]
    first, last = matched.stretch(int(np.argmax(amplitudes)))
    assert abs(first - 7 * width) <= max(matched.block, 1)
    assert abs(last - first - width) <= matched.block
    assert amplitudes.max() * matched.sigma == pytest.approx(1.0, rel=0.03)


def test_white_noise_has_amplitudes_of_unit_variance_in_so_many_degrees() -> None:
    rng, matched = np.random.default_rng(1), MatchedFilter.for_length(60)
    means = []
    for _ in range(400):
        means += (
            np.square(matched.amplitudes(rng.standard_normal((3000, 6))))
            .mean(0)
            .tolist()
        )
    assert np.mean(means) == pytest.approx(1.0, abs=0.01)
    count = len(matched.amplitudes(np.zeros((3000, 6))))
    dof = 2 / np.var(means)
    assert dof == pytest.approx(count / matched.amplitudes_per_dof, rel=0.1)


def test_what_is_missing_has_no_amplitude() -> None:
    z = np.random.default_rng(2).standard_normal((200, 6))
    z[100, 3] = np.nan
    missing = np.isnan(MatchedFilter.for_length(10).amplitudes(z))
    assert missing[:, 3].sum() == 20 and not missing[:, :3].any()


@pytest.mark.parametrize("nu", [1.0, 3.0, 12.0, 1e6])
def test_the_chance_is_the_tail_of_fishers_distribution(nu: float) -> None:
    amplitudes = np.zeros((5, 6))
    amplitudes[:, 4] = [0.5, 2.0, 5.0, 10.0, 20.0]
    found = AmplitudeNoise(np.ones(6), np.full(6, nu), ONE).log_chances(amplitudes)
    exact = stats.f.logsf(amplitudes[:, 4] ** 2 / 3, 3, nu)
    assert (found[:, 1] - exact < 0.0).all()
    assert found[:, 1] == pytest.approx(exact, abs=0.125)
    assert found[:, 0].tolist() == [0.0] * 5


def test_axes_that_move_together_are_not_counted_thrice() -> None:
    together = np.full((3, 3), 0.99) + 0.01 * np.eye(3)
    correlation = np.eye(6)
    correlation[:3, :3] = together
    noise = AmplitudeNoise(np.ones(6), np.full(6, 1e9), correlation)
    same, other = np.zeros(6), np.zeros(6)
    same[:3], other[:3] = 4.0, (1.0, -1.0, 0.0)
    found = noise.log_chances(np.array([same, other]))[:, 0]
    for one, log_chance in zip((same, other), found.tolist(), strict=True):
        q = float(one[:3] @ np.linalg.solve(together, one[:3]))
        assert log_chance == pytest.approx(stats.chi2.logsf(q, 3), abs=0.13)
    assert found[1] < -90 < -10 < found[0]


def drawn(nu: float, dof: int, windows: int, seed: int) -> list[Array]:
    """White amplitudes of windows, whose variances are drawn about 4."""
    rng = np.random.default_rng(seed)
    variance = 4.0 * nu / rng.chisquare(nu, windows)
    return [np.sqrt(v) * rng.standard_normal((dof, 6)) for v in variance]


def test_windows_of_white_noise_share_its_variance() -> None:
    white = MatchedFilter(1, np.array([1.0]), 1.0)
    windows = [w / 2 for w in drawn(1e9, 12, 40, 5)]
    for one in amplitude_noise(windows, white):
        assert one.dof.min() > 60
        assert one.variance == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_a_few_windows_of_a_hand_do_not_say_how_the_next_sways(seed: int) -> None:
    """By chance the few may look alike; one that sways six times as far is no push."""
    white = MatchedFilter(1, np.array([1.0]), 1.0)
    windows = drawn(1e9, 4, 10, seed)
    windows[0] *= 6.0
    first = amplitude_noise(windows, white)[0]
    assert first.log_chances(windows[0]).min() > np.log(1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_a_hand_that_trembles_about_one_axis_may_lean_about_another(seed: int) -> None:
    """On a table, where no axis shows any sway, the same is a push."""
    white = MatchedFilter(1, np.array([1.0]), 1.0)
    told = []
    for tremor in (4.0, 1.0):
        windows = [w / 2 for w in drawn(1e9, 4, 10, seed)]
        for w in windows:
            w[:, 3] *= tremor
        windows[0][:, 1] = [1.0, -0.5, 12.0, 0.5]
        first = amplitude_noise(windows, white)[0]
        told.append(first.log_chances(windows[0])[:, 0].min())
    assert told[0] > np.log(1e-5) > np.log(1e-7) > told[1]


def test_the_variance_at_an_instant_knows_nothing_of_it() -> None:
    white = MatchedFilter(1, np.array([1.0]), 1.0)
    windows = drawn(1e9, 50, 1, 6)
    windows[0][20, 2] = 1e3
    (noise,) = amplitude_noise(windows, white)
    rest = np.delete(windows[0][:, 2], 20)
    assert noise.variance[20, 2] == pytest.approx(np.square(rest).mean())
    assert noise.variance[21, 2] > 1e4
