"""The error of a mean against the error made, and its formulas against slow ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.windows import mean_error
from fieldcal.windows.mean_error import (
    CORNERS,
    KNEES,
    SHAPES,
    WALKS,
    SpectrumShapes,
    error_of_mean,
    fourier_sums,
    log_likelihood,
    without_lines,
)
from windows.signals import flicker, low_passed, markov, white


def pulls(source: Callable[..., Array], channels: int = 900) -> Array:
    """Difference of neighbouring 30 s means over its stated error."""
    cells = []
    for seed in range(channels // 300):
        x = source(np.random.default_rng(seed), 6000, 300)
        cells.append(x.reshape(600, 10, 300).mean(axis=1))
    y = np.hstack(cells)
    a, b = (error_of_mean(part, 0.1).covariance for part in (y[:300], y[300:]))
    return np.asarray(
        (y[:300].mean(axis=0) - y[300:].mean(axis=0)) / np.sqrt(np.diag(a) + np.diag(b))
    )


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("source", "least", "most"),
    [
        (white, 0.90, 1.04),
        pytest.param(low_passed(20), 0.90, 1.04, marks=pytest.mark.thorough),
        (low_passed(5), 0.90, 1.04),
        pytest.param(markov(0.5), 0.90, 1.04, marks=pytest.mark.thorough),
        pytest.param(markov(0.95), 0.70, 1.0, marks=pytest.mark.thorough),
        (flicker(1.0), 0.80, 1.1),
    ],
)
def test_the_error_stated_is_the_error_made(
    source: Callable[..., Array], least: float, most: float
) -> None:
    found = pulls(source)
    assert least < found.std() < most
    assert np.mean(np.abs(found) > 1.96) < 0.075


def shape(
    corner: float = np.inf, knee: float = 0.0, walk: float = 0.0
) -> SpectrumShapes:
    one = (np.array([x]) for x in (corner, knee, walk, 0.0))
    return SpectrumShapes(*one)


def test_spectra_over_white_noise() -> None:
    f = np.array([0.1, 0.5, 2.0])
    np.testing.assert_allclose(shape().spectra(f), [[1, 1, 1]])
    # a first-order low-pass has half its power at the corner
    assert shape(corner=0.5).spectra(f)[0, 1] == pytest.approx(0.5)
    assert shape(corner=0.5).spectra(f)[0, 2] == pytest.approx(1 / 17)
    # flicker and walk are as large as white noise at the knee
    np.testing.assert_allclose(shape(knee=0.5).spectra(f), [[6, 2, 1.25]])
    np.testing.assert_allclose(shape(walk=0.5).spectra(f), [[26, 2, 1.0625]])


@pytest.mark.parametrize("seconds", [1.0, 30.0])
@pytest.mark.parametrize(
    "of",
    [{"corner": 0.15}, {"corner": 1.2}, {"knee": 0.02}, {"knee": 2.0}, {"walk": 0.03}],
)
def test_the_variance_of_a_mean_is_that_of_its_spectrum(
    of: dict[str, float], seconds: float
) -> None:
    """Allan variance by its transfer function, IEEE 952 (C.2), summed over f."""
    family = shape(**of)
    f = np.geomspace(1e-5, 1e3, 400_001)
    x = np.pi * f * seconds
    seen = np.sin(x) ** 4 / x**2
    white = np.trapezoid(seen, f)
    found = np.trapezoid(family.spectra(f)[0] * seen, f) / white
    assert family.variance(seconds)[0] == pytest.approx(found, rel=1e-3)
    assert shape().variance(seconds)[0] == 1.0


def test_the_family_is_every_corner_with_every_knee_and_the_walks() -> None:
    made = mean_error._shape_family()
    for name in ("corner", "knee", "walk", "log_prior"):
        np.testing.assert_array_equal(getattr(made, name), getattr(SHAPES, name))
    rows = list(zip(made.corner, made.knee, made.walk, strict=True))
    expected = {(c, k, 0.0) for c in CORNERS for k in KNEES}
    expected |= {(np.inf, 0.0, r) for r in WALKS}
    assert set(rows) == expected and len(rows) == len(expected)
    prior = np.exp(made.log_prior)
    assert prior.sum() == pytest.approx(1.0)
    white = rows.index((np.inf, 0.0, 0.0))
    assert prior[white] == pytest.approx(0.998 * 0.92 * 0.97)
    low = prior[np.isfinite(SHAPES.corner)].sum()
    assert low == pytest.approx(0.998 * 0.08)
    assert prior[SHAPES.knee > 0].sum() == pytest.approx(0.998 * 0.03)
    # each corner and each knee is as likely as the others
    assert prior[rows.index((0.6, 0.0, 0.0))] == pytest.approx(0.998 * 0.016 * 0.97)
    assert prior[rows.index((np.inf, 0.2, 0.0))] == pytest.approx(0.998 * 0.92 * 0.005)
    assert prior[rows.index((np.inf, 0.0, 0.1))] == pytest.approx(0.002 / 6)
    assert prior[SHAPES.walk > 0].sum() == pytest.approx(0.002)


def test_the_likelihood_is_that_of_exponential_powers_at_their_best_level() -> None:
    """Whittle: each power is exponential about w g; w at its best is Q / n."""
    rng = np.random.default_rng(0)
    f = np.linspace(0.1, 2.5, 30)
    g = SHAPES.spectra(f)
    power = rng.exponential(size=(30, 3))
    found, q = log_likelihood(power, g)
    level = q / 30
    for s, c in [(0, 0), (10, 1), (44, 2)]:
        mean = level[s, c] * g[s]
        full = -np.log(mean).sum() - (power[:, c] / mean).sum()
        # but for what is the same for all shapes
        assert found[s, c] - full == pytest.approx(30 - 30 * np.log(30))
    nothing, zero = log_likelihood(np.zeros((30, 1)), g)
    np.testing.assert_allclose(nothing[:, 0], -np.log(g).sum(axis=1))
    assert not zero.any()


def test_the_transform_is_a_sum_of_cosines_and_sines_up_to_the_band() -> None:
    m, spacing = 200, 0.1
    y = np.random.default_rng(1).normal(size=(m, 2))
    f, sums = fourier_sums(y, spacing)
    np.testing.assert_allclose(f, np.arange(1, 51) / 20.0)
    for j in (0, 7, 49):
        turns = np.exp(-2j * np.pi * f[j] * spacing * np.arange(m))
        np.testing.assert_allclose(sums[j], turns @ y / np.sqrt(m))


@pytest.mark.parametrize(("m", "number"), [(20, 8), (12, 5), (3, 1), (100, 25)])
def test_of_short_windows_eight_frequencies_are_used_if_there_are_as_many(
    m: int, number: int
) -> None:
    f, sums = fourier_sums(np.random.default_rng(m).normal(size=(m, 1)), 0.1)
    assert len(f) == len(sums) == number
    np.testing.assert_allclose(f, np.arange(1, number + 1) / (0.1 * m))


def test_a_line_is_cut_to_the_most_that_noise_beside_it_shows() -> None:
    power = np.random.default_rng(2).exponential(size=(60, 2))
    power[30, 0], power[2, 0], power[4, 1], power[58, 1] = 500.0, 500.0, 500.0, 500.0
    found = without_lines(power)
    # mirrored at both ends, as long as there are no neighbours
    rows = np.abs(np.arange(-10, 70))
    rows = np.where(rows > 59, 118 - rows, rows)
    for i, c in [(30, 0), (4, 1), (58, 1)]:
        local = np.median(power[rows[i : i + 21], c])
        assert found[i, c] == pytest.approx(8 * local / np.log(2))
    assert found[2, 0] == 500.0, "a drift is no line"
    others = np.ones_like(power, dtype=bool)
    others[[30, 4, 58], [0, 1, 1]] = False
    np.testing.assert_array_equal(found[others], power[others])


@pytest.mark.parametrize(("n", "cut"), [(20, False), (21, True)])
def test_few_frequencies_have_no_neighbours_to_be_a_line_beside(
    n: int, cut: bool
) -> None:
    power = np.ones((n, 1))
    power[10] = 500.0
    assert (without_lines(power)[10] < 500.0) == cut


def slow(y: Array, spacing: float, before: Array | None = None) -> tuple[float, Array]:
    """(5) of one channel (m,) and its weights, shape by shape."""
    m = len(y)
    f, sums = fourier_sums((y - y.mean())[:, None], spacing)
    power = without_lines(np.abs(sums) ** 2)[:, 0]
    logs, q = [], []
    for i in range(len(SHAPES.corner)):
        g = 1 / (1 + (f / SHAPES.corner[i]) ** 2)
        g = g + SHAPES.knee[i] / f + (SHAPES.walk[i] / f) ** 2
        q.append(np.sum(power / g))
        logs.append(-np.sum(np.log(g)) - len(f) * np.log(q[-1]))
    seen = np.array(logs) + (0 if before is None else before)
    chance = np.exp(seen + SHAPES.log_prior - np.max(seen + SHAPES.log_prior))
    chance /= chance.sum()
    size = SHAPES.variance(m * spacing) / m
    return float(np.sum(chance * q / (len(f) - 1) * size)), seen - seen.max()


@pytest.mark.parametrize("m", [40, 300])
def test_the_variance_is_the_mean_over_the_shapes(m: int) -> None:
    rng = np.random.default_rng(m)
    y = np.column_stack([rng.normal(size=m), np.cumsum(rng.normal(size=m)) + 100])
    found = error_of_mean(y, 0.1)
    after = error_of_mean(y, 0.1, found.shape_likelihood)
    for c in range(2):
        variance, seen = slow(y[:, c], 0.1)
        assert found.covariance[c, c] == pytest.approx(variance)
        np.testing.assert_allclose(found.shape_likelihood[:, c], seen, atol=1e-9)
        variance, seen = slow(y[:, c], 0.1, found.shape_likelihood[:, c])
        assert after.covariance[c, c] == pytest.approx(variance)
        np.testing.assert_allclose(after.shape_likelihood[:, c], seen, atol=1e-9)


def test_twice_the_time_halves_the_variance_of_white_noise_and_not_of_a_walk() -> None:
    rng = np.random.default_rng(3)
    y = np.column_stack(
        [rng.normal(size=600), np.cumsum(rng.normal(size=600)), np.ones(600)]
    )
    found = error_of_mean(y, 0.1)
    ratio = found.sigma_of_doubled[:2] ** 2 / np.diag(found.covariance)[:2]
    assert ratio[0] == pytest.approx(0.5, abs=0.03) and ratio[1] > 1.8
    assert not found.covariance[2].any() and found.sigma_of_doubled[2] == 0


def test_the_covariance_is_that_of_the_whitened_channels() -> None:
    rng = np.random.default_rng(4)
    common = rng.normal(size=(3000, 1))
    y = common * [1.0, -1.0, 0.0] + rng.normal(size=(3000, 3))
    covariance = error_of_mean(y, 0.1).covariance
    size = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(covariance, covariance.T)
    expected = np.array([[1, -0.5, 0], [-0.5, 1, 0], [0, 0, 1]])
    np.testing.assert_allclose(covariance / np.outer(size, size), expected, atol=0.1)
    # channels of which one runs ahead of the other by a quarter of a turn share nothing
    t = np.arange(300) / 10
    turning = np.column_stack([np.cos(np.pi * t), np.sin(np.pi * t)])
    across = error_of_mean(turning, 0.1).covariance
    assert abs(across[0, 1]) < 0.01 * across[0, 0]


def test_what_wanders_alone_does_not_hide_what_channels_share() -> None:
    """They wander against each other below 0.2 Hz; above, their noise is common."""
    rng = np.random.default_rng(5)
    common = rng.normal(size=(3000, 1))
    walk = np.cumsum(0.1 * rng.normal(size=(3000, 1)), axis=0) * [1.0, -1.0]
    covariance = np.asarray(error_of_mean(common + walk, 0.1).covariance)
    shared = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert shared > 0.5
