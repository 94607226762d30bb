"""What rounding leaves in a mean, against the mean of rounded values by quadrature."""

from __future__ import annotations

import doctest
from functools import cache

import numpy as np
import pytest
from scipy.special import ndtr

from fieldcal.windows import rounding

LEVELS = np.arange(-9, 10)


@cache
def exact(noise: float, share: float) -> tuple[float, float]:
    """Mean less truth and deviation of round(share + noise n), steps."""
    edges = ndtr((LEVELS[:, None] + [-0.5, 0.5] - share) / noise)
    p = edges[:, 1] - edges[:, 0]
    mean = float(p @ LEVELS)
    return mean - share, float(np.sqrt(p @ (LEVELS - mean) ** 2))


@pytest.mark.parametrize("noise", [0.12, 0.2, 0.3, 0.4, 0.6])
@pytest.mark.parametrize("step", [1.0, 0.25])
def test_a_mean_of_rounded_values_is_off_as_far_as_it_says(
    noise: float, step: float
) -> None:
    off = np.array([exact(noise, v)[0] for v in np.linspace(-0.5, 0.5, 401)[:-1]])
    sampled = step * np.sqrt(noise**2 + 1 / 12)
    found = rounding.variance_of_mean(np.array([step]), np.array([sampled]))
    assert found[0] == pytest.approx(step**2 * np.mean(off**2), rel=1e-3, abs=1e-15)


def test_what_does_not_vary_is_off_by_anything_within_a_step() -> None:
    steps, still = np.array([0.5, 0.0]), np.zeros(2)
    np.testing.assert_allclose(
        rounding.variance_of_mean(steps, still), [0.25 / 12, 0.0]
    )
    np.testing.assert_allclose(
        rounding.variance_of_few_values(steps, still), [0.25 / 12, 0.0]
    )
    np.testing.assert_allclose(
        rounding.least_deviation(steps), [0.5 / np.sqrt(12), 0.0]
    )
    np.testing.assert_array_equal(rounding.noise_before_rounding(still, steps), still)


def test_many_windows_of_many_channels_at_once() -> None:
    step, sampled = np.array([1.0, 0.5]), np.array([[0.4, 0.3], [0.6, 0.1]])
    for of in (rounding.variance_of_mean, rounding.variance_of_few_values):
        every = of(step, sampled)
        assert every.shape == (2, 2)
        for row, values in zip(every, sampled, strict=True):
            np.testing.assert_allclose(row, of(step, values))


def test_the_steps_leave_the_noise_that_was_there_before() -> None:
    noise = np.array([0.7, 2.0])
    sampled = [exact(float(s), 0.1)[1] for s in noise]
    found = rounding.noise_before_rounding(np.array(sampled), np.ones(2))
    np.testing.assert_allclose(found, noise, rtol=2e-3)
    # nothing is below 0, whatever the step
    assert rounding.noise_before_rounding(np.array([0.1]), np.ones(1)) == 0


@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
def test_two_values_that_take_turns_tell_where_between_them_the_mean_is(
    step: float,
) -> None:
    """(3) is near the mean square error over all noise below 0.3 steps."""
    rows = [
        (step * v, step * s)
        for noise in np.linspace(0.02, 0.3, 40)
        for v, s in [exact(noise, at) for at in np.linspace(-0.5, 0.5, 101)]
    ]
    off, sampled = np.array(rows).T
    share = (sampled / step) ** 2
    stated = rounding.variance_of_few_values(np.full(len(rows), step), sampled)
    for low in (0.0, 0.1, 0.2):
        here = (share >= low) & (share < low + 0.05)
        ratio = np.mean(off[here] ** 2) / np.mean(stated[here])
        assert 0.3 < ratio < 1.3  # a window does not tell all of it: the safe side
    # two values in equal parts: 4 p (1 - p) = 1, of which a tenth is left to doubt
    even = rounding.variance_of_few_values(np.array([step]), np.array([step / 2]))
    assert even == pytest.approx(0.1 * step**2 / 12)
    assert rounding.variance_of_few_values(np.array([step]), np.array([step])) == 0


@pytest.mark.parametrize("noise", [0.15, 0.2, 0.3, 0.45])
def test_how_often_neighbours_differ_bounds_their_scatter(noise: float) -> None:
    """(4) by drawing: in the middle of a step it is the scatter, elsewhere more."""
    rng = np.random.default_rng(4)
    for middle in (0.0, 0.2, 0.35, 0.5):
        values = np.round(middle + noise * rng.normal(size=200_000))
        changed = np.array([np.mean(np.diff(values) != 0)])
        ratio = rounding.largest_deviation(np.ones(1), changed)[0] / values.std()
        assert ratio == pytest.approx(1, rel=0.03) if middle == 0 else ratio > 1
    assert rounding.largest_deviation(np.full(1, 3.0), np.ones(1)) == np.sqrt(6)


def test_single_steps_show_where_the_noise_is_lower() -> None:
    step = np.full(5, 2.0)
    sampled = np.array([0.0, 1.1, 1.2, 5.0, np.nan])
    np.testing.assert_array_equal(
        rounding.visible_steps(step, sampled), [2, 2, 0, 0, 2]
    )
    assert rounding.visible_steps(np.zeros(1), np.zeros(1)) == 0


def test_examples() -> None:
    failed, tried = doctest.testmod(rounding, extraglobs={"np": np})
    assert tried and not failed


@pytest.mark.parametrize("noise", [0.05, 0.12, 0.3])
@pytest.mark.parametrize("apart", [0.0, 0.2, 0.5, 1.8])
def test_errors_of_two_means_have_the_covariance_that_it_says(
    noise: float, apart: float
) -> None:
    places = np.linspace(-0.5, 0.5, 801)[:-1]
    off, other = (
        np.array([exact(noise, v + more)[0] for v in places]) for more in (0.0, apart)
    )
    sampled = 0.25 * np.sqrt(noise**2 + 1 / 12)
    found = rounding.covariance_of_two_means(0.25, sampled, np.array([0.25 * apart]))
    assert found[0] == pytest.approx(0.25**2 * np.mean(off * other), abs=2e-5)
