"""Flicker of a few windows as a series: against processes that make it in time."""

from __future__ import annotations

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.model import resolutions
from fieldcal.model.causes.flicker_series import FlickerSeries

DRAWS = 4000


def growing(count: int = 40, ratio: float = 1.2) -> tuple[Array, Array]:
    """Middles and lengths of rows each of which is longer than the one before, s."""
    length = ratio ** np.arange(count)
    end = np.cumsum(length)
    return end - length / 2, length


def even(count: int = 40) -> tuple[Array, Array]:
    return np.arange(count) + 0.5, np.ones(count)


def drawn(t: Array, length: Array, seed: int) -> Array:
    """Means of flicker with a = 1, (draws, n): sums of processes that forget.

    Each has the power 4 T / (1 + (2 pi f T)^2); with ln T in steps of 0.25 these make
    4 / f together, so an eighth of it is 1 / (2 f).
    """
    rng = np.random.default_rng(seed)
    lasts = np.exp(np.arange(-6.0, 17.0, 0.25))[:, None, None]
    start, end = t - length / 2, t + length / 2
    # means over intervals of one: its covariance in closed form
    apart = [np.subtract.outer(a, b) for a in (start, end) for b in (start, end)]
    kernel = [lasts**2 * np.exp(-np.abs(x) / lasts) + lasts * np.abs(x) for x in apart]
    whole = (kernel[1] + kernel[2] - kernel[0] - kernel[3]) / np.outer(length, length)
    covariance = whole.sum(axis=0) / 8
    return rng.multivariate_normal(np.zeros(len(t)), covariance, size=DRAWS)


@pytest.mark.parametrize("rows", [growing(), even()])
def test_it_is_the_covariance_of_flicker(rows: tuple[Array, Array]) -> None:
    """Of what the rows differ by from their mean: the mean itself a bias takes in."""
    series = FlickerSeries.of(*rows)
    some = drawn(*rows, 1)
    some = some - some.mean(axis=1)[:, None]
    found = (series.terms * series.sizes**2) @ series.terms.T
    found += (series.others * series.variances) @ series.others.T
    seen = some.T @ some / DRAWS
    scatter = np.sqrt(np.outer(np.diag(seen), np.diag(seen)) / DRAWS)
    assert np.abs(found - seen).max() < 6 * scatter.max()
    assert np.sqrt(np.mean(((found - seen) / scatter) ** 2)) < 1.6


def test_neighbours_differ_by_the_allan_variance_of_flicker() -> None:
    """2 ln 2 / pi B^2 with B^2 = pi a^2 / 2 (IEEE Std 952): half the mean square."""
    series = FlickerSeries.of(*even())
    step = np.diff(series.terms, axis=0) * series.sizes
    beside = np.diff(series.others, axis=0) * np.sqrt(series.variances)
    square = (step**2).sum(axis=1) + (beside**2).sum(axis=1)
    np.testing.assert_allclose(square / 2, np.log(2), rtol=1e-6)


def test_what_the_terms_leave_has_the_size_of_what_is_there() -> None:
    rows = growing(120, 1.06)
    series = FlickerSeries.of(*rows)
    assert series.terms.shape == (120, 60)
    rng = np.random.default_rng(3)
    sd = np.tile(2e-3 / np.sqrt(rows[1])[:, None], (1, 6))
    flicker = drawn(*rows, 2)[:60].reshape(10, 6, 120)
    # a course as slow as of a device that warms up is no part of it
    slow = 0.05 * np.exp(-rows[0] / rows[0][-1])[:, None]
    whole = (series.others**2) @ series.variances
    for size in (3e-4, 3e-3):
        ratio = []
        for one in flicker:
            y = size * one.T + sd * rng.standard_normal((120, 6)) + slow
            left = series.residual_variance(y, sd, np.full(6, 1e-3))
            ratio.append(left[50] / (size**2 * whole[50]))
        assert np.median(ratio) == pytest.approx(1.0, abs=0.8)
    nothing = series.residual_variance(
        sd * rng.standard_normal((120, 6)), sd, np.full(6, 1e-3)
    )
    assert (nothing[-1] < sd[-1] ** 2).all()


def test_a_channel_that_was_not_measured_has_none() -> None:
    rows = even(100)
    y, sd = np.zeros((100, 3)), np.full((100, 3), 1e-3)
    y[:, 0] = 10 * drawn(*rows, 4)[0]
    y[:, 1] = np.nan
    sd[:, 2] = np.nan
    left = FlickerSeries.of(*rows).residual_variance(y, sd, np.ones(3))
    assert (left[:, 0] > 0).all() and not left[:, 1:].any()


def test_a_row_that_was_not_measured_changes_little() -> None:
    rows = even(100)
    series, y, sd = (
        FlickerSeries.of(*rows),
        drawn(*rows, 5)[:6].T,
        np.full((100, 6), 0.1),
    )
    whole = series.residual_variance(y, sd, np.ones(6))
    y[[3, 50, 51]] = np.nan
    ratio = series.residual_variance(y, sd, np.ones(6)) / whole
    assert (ratio > 0.2).all() and (ratio < 5).all()


def test_between_rows_a_term_goes_on() -> None:
    series = FlickerSeries.of(*growing(200, 1.02))
    assert series.terms.shape[1] == resolutions.MAX_COSINES
    np.testing.assert_allclose(series.at(series.t), series.terms)
    middle = series.at((series.t[:1] + series.t[1:2]) / 2)
    np.testing.assert_allclose(middle[0], series.terms[:2].mean(axis=0))
