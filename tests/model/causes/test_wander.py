"""How the biases wander inside windows: measured, and what cosines leave of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_sessions import SD, ladder, rows_of

from fieldcal.model import resolutions
from fieldcal.model.causes.wander import Wander
from fieldcal.model.rows.averages import Rows
from fieldcal.physics.experience_rows import select_rows

X = ladder(rows=30)
UNIT = np.ones(6)


FINE = 20
"""Instants of a random course to one row."""


def walk(rng: np.random.Generator, lasts: float = 1.0) -> np.ndarray:
    """Means of a walk of 1 per sqrt(s) in rows of X, in each window for itself."""
    out = []
    for p in np.unique(X.position):
        count = int((X.position == p).sum()) * FINE
        course = np.cumsum(rng.standard_normal(count) * np.sqrt(lasts / FINE))
        out.append(course.reshape(-1, FINE).mean(axis=1))
    return np.concatenate(out)


def flicker(rng: np.random.Generator) -> np.ndarray:
    """Means of flicker with a = 1: Gauss-Markov processes, four to a factor of e."""
    lasts = np.exp(np.arange(-5.0, 9.0, 0.25))
    out = []
    for p in np.unique(X.position):
        count = int((X.position == p).sum()) * FINE
        kept = np.exp(-1 / FINE / lasts)
        state, course = rng.standard_normal(len(lasts)), np.empty(count)
        for i in range(count):
            new = rng.standard_normal(len(lasts))
            state = kept * state + np.sqrt(1 - kept**2) * new
            course[i] = state.sum()
        # of power a^2 / (2 f): each has 4 lasts / (1 + (2 pi f lasts)^2), and over all
        # of them, ln lasts being 0.25 apart, 4 / 0.25 * pi / 2 / (2 pi f) = 4 / f
        out.append(course.reshape(-1, FINE).mean(axis=1) / np.sqrt(8.0))
    return np.concatenate(out)


def recorded(rng: np.random.Generator, size: float, courses: np.ndarray) -> Rows:
    """Rows of which some have a course as well, and az something that settles."""
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    y[:, : courses.shape[1]] += size * courses
    y[:, 2] += 0.1 * np.exp(-X.since_turn / 3.0)
    return rows_of(X, y)


@pytest.mark.parametrize("size", [1e-3, 5e-3])
def test_a_walk_is_measured_beside_what_settles(size: float) -> None:
    """Seen at its own size, whatever the first rows after a turn do."""
    found, shares = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        courses = np.column_stack([np.zeros(len(X)), walk(rng)])
        one = Wander.of(recorded(rng, size, courses), UNIT)
        assert one.modes[1] > resolutions.COSINES
        assert (one.walk_rate[[0, 2, 3, 4, 5]] < 0.1 * size).all()
        shares.append(one.share[1])
        found.append(one.walk_rate[1])
    assert np.median(found) == pytest.approx(size, rel=0.2)
    assert np.median(shares) < 0.7  # before the rows it is 0.9


@pytest.mark.parametrize("size", [2e-3, pytest.param(1e-2, marks=pytest.mark.thorough)])
def test_flicker_is_measured_and_is_no_walk(size: float) -> None:
    """At its own size: and cosines are as many as are above the noise, (5)."""
    found = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        courses = np.column_stack([flicker(rng) for _ in range(3)])
        one = Wander.of(recorded(rng, size, courses), UNIT)
        assert np.ptp(one.flicker[:3]) < 1e-9 * size  # made alike
        assert one.residual_variance(np.ones(1), 4)[0] < 0.03 * SD[4] ** 2
        found.append(one.flicker[1])
        modes = 2 * one.flicker[1] ** 2 * len(X) / (2 * SD[1] ** 2)
        assert one.modes[1] == int(
            np.clip(modes, resolutions.COSINES, resolutions.MAX_COSINES)
        )
        assert one.share[1] > 0.5
        assert one.residual_variance(np.ones(1), 1)[0] > 0.05 * one.flicker[1] ** 2
    assert np.median(found) == pytest.approx(size, rel=0.25)


def test_outputs_in_counts_wander_by_counts() -> None:
    """Of outputs ten times as large everything is ten times as large."""
    rng = np.random.default_rng(3)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    steps = np.sqrt(np.diff(X.t, prepend=0.0)) * rng.standard_normal(len(X))
    y[:, 1] += 3e-3 * np.cumsum(steps)
    plain = rows_of(X, y)
    unit = np.array([10.0, 10.0, 0.2, 5.0, 1.0, 1.0])
    counted = replace(plain, y=plain.y * unit, sd=plain.sd * unit)
    one, many = Wander.of(plain, UNIT), Wander.of(counted, unit)
    np.testing.assert_allclose(many.walk_rate, one.walk_rate * unit, rtol=1e-9)
    np.testing.assert_array_equal(many.modes, one.modes)
    assert many.length == one.length == pytest.approx(np.ptp(X.t))


def test_cosines_beyond_the_noise_are_as_many_as_it_is_above_it() -> None:
    """(4), with the information of all rows of the channel."""
    rng = np.random.default_rng(3)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    steps = np.sqrt(np.diff(X.t, prepend=0.0)) * rng.standard_normal(len(X))
    y[:, 1] += 2e-3 * np.cumsum(steps)
    found = Wander.of(rows_of(X, y), UNIT)
    length = np.ptp(X.t)
    information = len(X) / (2 * SD[1] ** 2)
    walks = found.walk_rate[1] * np.sqrt(2 * length * information) / np.pi
    modes = 2 * max(walks, found.flicker[1] ** 2 * information)
    assert (
        found.modes[1] == int(min(modes, resolutions.MAX_COSINES)) > resolutions.COSINES
    )
    none = Wander.none()
    assert not none.walk_rate.any() and set(none.modes) == {resolutions.COSINES}
    assert not none.residual_covariance(np.arange(3.0), np.ones(3)).any()


def test_of_few_differences_nothing_is_told() -> None:
    for places in (7, 8):  # one of the later half of five rows each
        kept = (np.arange(len(X)) % 30 < 5) & (X.position < places)
        some = select_rows(X, np.flatnonzero(kept).tolist())
        y = np.random.default_rng(1).standard_normal((len(some), 6))
        assert Wander.of(rows_of(some, y), UNIT).walk_rate.any() == (places == 8)


def test_what_goes_evenly_does_not_wander() -> None:
    rng = np.random.default_rng(3)
    y = np.hstack([X.f, X.w]) + SD * rng.standard_normal((len(X), 6))
    y[:, 0] += 1e-3 * X.t
    level = Wander.of(rows_of(X, y), UNIT).walk_rate[0]
    assert level < 2e-5


def test_what_cosines_leave_is_the_rest_of_their_series() -> None:
    """(2) and (3), against so many cosines that no more is left."""
    length, count = 300.0, 60
    q = np.array([2e-3] * 3 + [0.0] * 3)
    share = np.repeat([0.0, 1.0], 3)
    one = Wander(q, q[::-1].copy(), share, np.full(6, count), length)
    t, piece = np.array([10.0, 10.5, 13.0, 40.0]), 0.5
    k = np.arange(count + 1, 40_000)
    fine = t[:, None] + piece * (np.arange(50) + 0.5) / 50 - piece / 2
    walks, flickers = q[0] ** 2 * length / (np.pi * k) ** 2, q[0] ** 2 / k / 2
    covariance = np.zeros((2, 4, 4))
    for i in range(4):
        for j in range(4):
            lag = np.abs(np.subtract.outer(fine[i], fine[j])).ravel()
            each, counts = np.unique(np.round(lag, 9), return_counts=True)
            waves = np.array([np.cos(np.pi * k * v / length) for v in each])
            values = waves @ np.column_stack([walks, flickers])
            covariance[:, i, j] = counts @ values / counts.sum()
    every = one.residual_covariance(t, np.full(4, piece))
    for c, there in zip((0, 5), covariance, strict=True):
        off = np.abs(every[c] - there)
        assert np.diag(off).max() < 0.002 * there[0, 0]
        assert off.max() < 0.06 * there[0, 0]  # of instants, not of means
        assert every[c][0, 0] == pytest.approx(
            one.residual_variance(np.array([piece]), c)[0]
        )


@pytest.mark.parametrize("lasts", [0.5, 4.0, 25.0])
def test_rows_keep_of_a_walk_what_cosines_beyond_have_over_them(lasts: float) -> None:
    """However many periods of a cosine a row lasts."""
    one = Wander(np.full(6, 2e-3), np.zeros(6), np.zeros(6), np.full(6, 60), 300.0)
    k = np.arange(61, 200_000)
    z = np.pi * k * lasts / 600.0
    every = 300.0 * (2e-3 / (np.pi * k) * np.sin(z) / z) ** 2
    assert one.residual_variance(np.array([lasts]), 1)[0] == pytest.approx(
        every.sum(), rel=1e-3
    )


def test_one_axis_may_walk_alone_and_none_flickers_alone() -> None:
    rng = np.random.default_rng(4)
    courses = np.column_stack([np.zeros(len(X)), walk(rng), np.zeros(len(X))])
    found = Wander.of(recorded(rng, 5e-3, courses), UNIT)
    assert found.walk_rate[1] > 20 * found.walk_rate[[0, 2]].max()
    assert np.ptp(found.flicker[:3]) < 1e-9


def test_of_few_windows_flicker_is_not_measured() -> None:
    """It is always there by itself, and a walk is measured as ever."""
    some = select_rows(X, np.flatnonzero(X.position < 2).tolist())
    rng = np.random.default_rng(6)
    y = np.hstack([some.f, some.w]) + SD * rng.standard_normal((len(some), 6))
    y[:, 1] += 5e-3 * walk(rng)[: len(some)]
    found = Wander.of(rows_of(some, y), UNIT)
    assert not found.flicker.any() and not found.share.any()
    assert found.walk_rate[1] == pytest.approx(5e-3, rel=0.5)
