"""What a triad makes of a motion, against recursions and closed forms."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from fieldcal.core.samples import Array, Block
from fieldcal.model import detections
from fieldcal.model.rows.low_pass import first_order, second_order
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.response import Response

W = np.array([0.7, 1.9, 4.1, 6.3, 9.0, 11.0])
T: Array = np.arange(0.0, 12.0, 0.01)
INSIDE = np.arange(3.0, 9.0, 0.0173)


def waves(t: Array, late: Array | float = 0.0, gain: Array | float = 1.0) -> Array:
    out: Array = gain * np.sin(W * (t[:, None] - late) + np.arange(6))
    return out


REFERENCE = Reference(Block.of(T, waves(T)[:, :3], waves(T)[:, 3:]))


def followed(tau: float, by: Reference = REFERENCE) -> Reference:
    return by.filtered_by(partial(first_order, tau=tau))


def smoothed(tau: float, by: Reference = REFERENCE) -> Reference:
    return by.filtered_by(partial(second_order, tau=tau))


def after_butterworth(t: Array, tau: float) -> Array:
    passes = 1 / (1 + 1j * np.sqrt(2) * W * tau - (W * tau) ** 2)
    return waves(t, -np.angle(passes) / W, np.abs(passes))


@pytest.mark.parametrize("tau", [1e-6, 1e-3, 0.02, 0.05])
def test_a_wave_comes_out_smaller_and_later_after_a_low_pass(tau: float) -> None:
    expected = waves(INSIDE, np.arctan(W * tau) / W, np.hypot(1, W * tau) ** -1)
    found = followed(tau).at(INSIDE)
    np.testing.assert_allclose(found, expected, atol=6e-5)


def test_what_a_low_pass_took_is_given_back() -> None:
    back = followed(-0.03, followed(0.03))
    np.testing.assert_allclose(back.at(INSIDE), waves(INSIDE), atol=3e-4)
    np.testing.assert_allclose(REFERENCE.at(INSIDE), waves(INSIDE), atol=1e-5)


@pytest.mark.parametrize("tau", [-0.04, -0.005, 0.004, 0.03])
def test_the_slope_is_what_an_output_loses_with_its_time_constant(tau: float) -> None:
    step = 1e-4
    up, down = (followed(tau + s).at(INSIDE) for s in (step, -step))
    found = Response.of(REFERENCE, 0.0, tau).slope.at(INSIDE)
    np.testing.assert_allclose(found, (down - up) / (2 * step), atol=0.05)
    assert np.abs(found).max() > 5


def test_without_a_time_constant_the_slope_is_that_to_the_least() -> None:
    found = Response.of(REFERENCE).slope.at(INSIDE)
    expected = (
        waves(INSIDE) - followed(detections.MIN_TIME_CONSTANT_S).at(INSIDE)
    ) / detections.MIN_TIME_CONSTANT_S
    np.testing.assert_allclose(found, expected, atol=0.02)


@pytest.mark.parametrize("tau", [1e-6, 1e-4, 2e-3, 0.02, 0.06])
def test_a_wave_comes_out_as_butterworth_says(tau: float) -> None:
    found = smoothed(tau).at(INSIDE)
    np.testing.assert_allclose(found, after_butterworth(INSIDE, tau), atol=6e-5)


def test_what_a_low_pass_of_second_order_took_is_given_back() -> None:
    back = smoothed(-0.03, smoothed(0.03))
    np.testing.assert_allclose(back.at(INSIDE), waves(INSIDE), atol=2e-4)


@pytest.mark.parametrize("tau", [-0.04, -0.02, 0.02, 0.05])
def test_the_bend_is_what_an_output_loses_in_the_second_order(tau: float) -> None:
    step = 1e-4
    up, down = (smoothed(tau + s).at(INSIDE) for s in (step, -step))
    found = Response.of(REFERENCE, second=tau).bend.at(INSIDE)
    np.testing.assert_allclose(found, (down - up) / (2 * step), atol=0.1)
    assert np.abs(found).max() > 5


def test_a_step_from_nothing_leads_to_the_low_pass_that_shows_as_much() -> None:
    """Beyond a delay it shows by the cube of tau, or by the square of first order."""
    plain = Response.of(REFERENCE)
    there = plain.step_towards(
        REFERENCE, 0.0, 0.0, 0.03**3 / (3 * detections.MIN_SECOND_ORDER_S**2)
    )
    assert there.second == pytest.approx(0.03)
    early = there.late + np.sqrt(2) * there.second
    assert early == pytest.approx(
        np.sqrt(2) * 0.03**3 / (3 * detections.MIN_SECOND_ORDER_S**2)
    )
    first = plain.step_towards(
        REFERENCE, 0.0, 0.03**2 / detections.MIN_TIME_CONSTANT_S, 0.0
    )
    assert first.tau == pytest.approx(0.03)
    assert plain.step_towards(REFERENCE, 0.01, 0.0, 0.0).sensed is REFERENCE
    exact = plain.step_towards(REFERENCE, 0.01, 0.02, 0.03, free=False)
    assert (exact.late, exact.tau, exact.second) == (0.01, 0.02, 0.03)
    assert there.distance_to(first) == pytest.approx(
        0.03 / detections.MIN_TIME_CONSTANT_S
    )


def test_a_wave_passes_low_passes_of_both_orders_in_turn() -> None:
    both = Response.of(REFERENCE, tau=0.02, second=0.03).sensed.at(INSIDE)
    expected = followed(0.02, smoothed(0.03)).at(INSIDE)
    np.testing.assert_allclose(both, expected, atol=6e-5)


def test_a_mean_over_samples_of_a_wave_is_a_smaller_wave() -> None:
    offsets = 0.01 * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    found = REFERENCE.averaged_over(offsets, 0.0125)
    smaller = np.cos(np.multiply.outer(offsets, W)).mean(axis=0)
    expected = waves(INSIDE, gain=smaller)
    np.testing.assert_allclose(found.at(INSIDE), expected, atol=1e-5)
    change = smaller * W * np.cos(W * INSIDE[:, None] + np.arange(6))
    np.testing.assert_allclose(found.at(INSIDE, 1), change, atol=2e-3)
    apart = np.diff(found.splines[0][1].x)
    np.testing.assert_allclose(apart, apart[0], rtol=1e-9)
    assert apart[0] == pytest.approx(0.0125, rel=1e-3)


def test_a_mean_keeps_pauses_of_the_reference() -> None:
    t = T[(T < 2.0) | (T > 2.5)]
    found = Reference(Block.of(t, waves(t)[:, :3], waves(t)[:, 3:]))
    mean = found.averaged_over(np.array([-0.01, 0.0, 0.01]), 0.02)
    knots = mean.splines[0][1].x
    assert np.diff(knots).max() == pytest.approx(0.52) and len(knots) < 600


def test_before_its_first_sample_a_reference_is_as_at_it() -> None:
    even = np.arange(0.0, 4.0, 0.01)
    rising = np.repeat(even[:, None], 6, axis=1)
    ramp = Reference(Block.of(even, rising[:, :3], rising[:, 3:]))
    found = followed(0.2, ramp)
    expected = even - 0.2 * (1 - np.exp(-even / 0.2))  # of a ramp that begins at 0
    np.testing.assert_allclose(found.at(even)[:, 0], expected, atol=0.02)


def test_uneven_knots_and_pauses_are_filtered_as_even_ones() -> None:
    rng = np.random.default_rng(5)
    t = T + rng.uniform(-2e-3, 2e-3, len(T))
    t = t[(t < 2.0) | (t > 2.5)]
    found = Reference(Block.of(t, waves(t)[:, :3], waves(t)[:, 3:]))
    np.testing.assert_allclose(
        smoothed(0.02, found).at(INSIDE), after_butterworth(INSIDE, 0.02), atol=2e-4
    )


def test_channels_sampled_at_other_instants_are_each_followed_by_their_own() -> None:
    six = waves(T)
    six[1::2, 3:] = np.nan  # gyroscopes at half the rate
    six[:, 1] = np.nan
    found = Reference(Block.of(T, six[:, :3], six[:, 3:]))
    np.testing.assert_array_equal(found.observed, [1, 0, 1, 1, 1, 1])
    np.testing.assert_array_equal(found.missing_channels, [1])
    expected = waves(INSIDE, np.arctan(W * 0.02) / W, np.hypot(1, W * 0.02) ** -1)
    expected[:, 1] = 0.0
    np.testing.assert_allclose(followed(0.02, found).at(INSIDE), expected, atol=3e-4)


def test_slopes_are_those_of_the_channels_that_are_asked_for() -> None:
    whole = Response.of(REFERENCE, 0.0, 0.02, 0.03)
    own = whole.step_towards(REFERENCE, 0.0, 0.02, 0.03, False, range(3))
    for some, every in ((own.slope, whole.slope), (own.bend, whole.bend)):
        found, expected = some.at(INSIDE), every.at(INSIDE)
        np.testing.assert_array_equal(found[:, :3], expected[:, :3])
        assert not found[:, 3:].any() and expected[:, 3:].any()
    np.testing.assert_array_equal(own.sensed.at(INSIDE), whole.sensed.at(INSIDE))
