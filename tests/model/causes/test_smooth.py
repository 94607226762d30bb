"""Smooth functions of covariates, at values that are worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import G, ladder

from fieldcal.model import priors, resolutions
from fieldcal.model.causes import smooth
from fieldcal.model.causes.smooth import CourseSpan
from fieldcal.physics.experience_rows import select_rows

X = ladder()


def test_waves_are_cosines_over_the_session() -> None:
    span = CourseSpan(np.array([10.0, 20.0, 50.0]), 5)
    x = replace(ladder(1), t=np.array([10.0, 20.0, 30.0, 50.0, 90.0, 0.0, 0, 0, 0]))
    found = span.waves(x)
    k = np.arange(1, 6)
    for row, part in zip(found, [0.0, 0.25, 0.5, 1.0, 1.0, 0.0], strict=False):
        np.testing.assert_allclose(row, np.cos(np.pi * k * part), atol=1e-12)
    assert (
        CourseSpan(X.t).count
        == resolutions.COSINES
        == CourseSpan(X.t).waves(X).shape[1]
    )
    alone = CourseSpan(np.array([3.0]))
    still = replace(ladder(1), t=np.full(9, 3.0))
    np.testing.assert_array_equal(alone.waves(still), np.ones((9, resolutions.COSINES)))


def test_a_row_has_the_mean_of_a_cosine_over_what_it_lasts() -> None:
    span, k = CourseSpan(np.array([0.0, 60.0]), 7), np.arange(1, 8)
    x = replace(ladder(1), t=np.full(9, 20.0), lasts=np.linspace(0.0, 16.0, 9))
    for row, lasts in zip(span.waves(x), x.lasts, strict=True):
        inside = 20.0 + lasts * (np.arange(2000) / 1999 - 0.5)
        mean = np.cos(np.pi * np.outer(inside / 60.0, k)).mean(axis=0)
        np.testing.assert_allclose(row, mean, atol=1e-3)


def test_a_walk_has_the_variance_of_its_series() -> None:
    """Of Brownian motion less its mean over T: T / 6 on average."""
    sizes = CourseSpan(np.array([0.0, 100.0]), 20_000).walk()
    assert (sizes**2).sum() / 2 == pytest.approx(100.0 / 6, rel=1e-3)
    np.testing.assert_allclose(sizes[0] / sizes[:4], [1, 2, 3, 4])


@pytest.mark.parametrize("span", priors.HALF_WAVES)
def test_a_smooth_course_has_unit_variance_and_fades(span: float) -> None:
    sizes = smooth.smooth_course_sizes(span)
    assert (sizes**2).sum() / 2 == pytest.approx(1.0)
    k = np.arange(1, len(sizes) + 1)
    np.testing.assert_allclose(
        np.log(sizes / sizes[0]), -0.5 * (k**2 - 1) / span**2, atol=1e-9
    )
    beyond = np.exp(-0.5 * ((len(sizes) + 1) / span) ** 2)
    assert beyond <= 1e-3 or len(sizes) == resolutions.COSINES
    assert np.exp(-0.5 * (len(sizes) / span) ** 2) > 1e-3


def test_a_force_that_changes_in_time() -> None:
    span = CourseSpan(X.t)
    found = span.fading(X)
    s = 2 * (X.t - X.t[0]) / np.ptp(X.t) - 1
    legendre = [s, (3 * s**2 - 1) / 2, (5 * s**3 - 3 * s) / 2,
                (35 * s**4 - 30 * s**2 + 3) / 8]  # fmt: skip
    assert found.shape == (len(X), 3 * resolutions.POLYNOMIALS)
    for axis in range(3):
        some = found[:, smooth.force_time_columns(axis)]
        for column, power in zip(some.T, legendre, strict=True):
            np.testing.assert_allclose(column, X.f[:, axis] / G * power, atol=1e-12)


def test_harmonics_of_the_joints() -> None:
    for angle, found in ((X.alpha, smooth.alpha(X)), (X.beta, smooth.beta(X))):
        k = np.arange(1, 5)
        turned = np.outer(angle, k)
        expected = np.hstack([np.sin(turned) / k, np.cos(turned) / k])
        np.testing.assert_allclose(found, expected)
    both = smooth.joints(X)
    assert both.shape == (len(X), 16)
    of = [
        [np.sin(a), np.sin(2 * a) / 2, np.cos(a), np.cos(2 * a) / 2]
        for a in (X.alpha, X.beta)
    ]
    expected = np.column_stack([one * two for one in of[0] for two in of[1]])
    np.testing.assert_allclose(both, expected)
    free = ladder(free=(2,))
    assert np.isfinite(smooth.alpha(free)).all()


def test_powers_of_the_force() -> None:
    f = X.f / G
    expected = np.hstack([f**2 / 2, f**3 / 3, f**4 / 4, f**5 / 5, np.abs(f) / 2])
    np.testing.assert_allclose(smooth.force(X), expected)


def test_powers_of_the_temperature_over_its_range() -> None:
    x = replace(X, warming=np.linspace(-1.0, 3.0, len(X)))
    part = (x.warming + 1.0) / 4.0
    expected = np.column_stack([part, part**2 / 2, part**3 / 3, part**4 / 4])
    span = CourseSpan(x.t, warming=x.warming)
    np.testing.assert_allclose(span.temperature(x), expected)
    # one row is worth what it is among the others
    for i in (0, 4, len(X) - 1):
        one = span.temperature(select_rows(x, [i]))
        np.testing.assert_allclose(one, expected[i : i + 1])
    unknown = np.full(len(X), np.nan)
    blind = replace(X, warming=unknown)
    assert not CourseSpan(X.t, warming=unknown).temperature(blind).any()


def test_powers_of_the_time_since_a_turn() -> None:
    since = np.where(np.arange(len(X)) == 1, np.inf, X.since_turn)
    since[2] = -3.0
    found = smooth.since_turn(replace(X, since_turn=since))
    part = np.log1p(np.clip(since, 0.0, 1e4)) / np.log(101.0)
    expected = np.column_stack([part, part**2 / 2, part**3 / 3, part**4 / 4])
    np.testing.assert_allclose(found, expected)
    assert not found[2].any() and np.isfinite(found[1]).all()


def test_every_covariate_has_its_function() -> None:
    span = CourseSpan(X.t)
    of = smooth.covariates(span)
    expected = {
        "alpha": smooth.alpha(X), "beta": smooth.beta(X), "joints": smooth.joints(X),
        "force": smooth.force(X), "force and time": span.fading(X),
        "temperature": span.temperature(X), "since turn": smooth.since_turn(X),
    }  # fmt: skip
    assert of.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(of[name](X), values)
