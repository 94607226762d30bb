"""What is cut toward zero, as an autopilot cuts it: means with an error that holds."""

import numpy as np
import pytest
from scipy.special import ndtr

from fieldcal.core.errors import Moved
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.windows import Average, average
from fieldcal.windows.grain import MEAN_OFFSETS, rounding_variance, visible_step
from fieldcal.windows.rounding import variance_of_few_values, variance_of_mean

STEP = np.repeat([9.80665e-3, 1e-3], 3)
CUT = Grain(STEP[0], STEP[3], cut=True)
ROUNDED = Grain(STEP[0], STEP[3])
SEEDS, N = 25, 1500


def window(values: Array, grain: Grain | None) -> Average:
    t = np.arange(N) / 50
    return average(Block.of(t, values[:, :3], values[:, 3:]), grain=grain)


def pulls(noise: float, centre: float, grain: Grain) -> tuple[Array, int]:
    """Errors over their stated size, and how many windows were taken for disturbed."""
    rng, found, moved = np.random.default_rng(5), [], 0
    for _ in range(SEEDS):
        v = centre + rng.uniform(-2, 2, 6)
        x = v + noise * rng.standard_normal((N, 6))
        k = np.trunc(x) + 0.5 * np.sign(np.trunc(x)) if grain.cut else np.rint(x)
        try:
            seen = window(k * STEP, grain)
        except Moved:
            moved += 1
            continue
        found.append((seen.mean / STEP - v) / (seen.sigma / STEP))
    return np.array(found), moved


SOME = [(0.0, 0.0, CUT), (0.0, 1000.0, ROUNDED), (0.3, 0.0, CUT), (0.3, 0.0, ROUNDED)]
"""At zero and far from it, cut and rounded, without noise and with some."""


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("noise", "centre", "grain"),
    [
        pytest.param(
            noise,
            centre,
            grain,
            marks=[] if (noise, centre, grain) in SOME else pytest.mark.thorough,
            id=f"{noise}-{centre}-{'cut' if grain.cut else 'rounded'}",
        )
        for noise in (0.0, 0.1, 0.3, 0.6, 1.0, 3.0)
        for centre in (0.0, 1000.0)
        for grain in (CUT, ROUNDED)
    ],
)
def test_the_error_of_a_mean_holds_however_little_noise(
    noise: float, centre: float, grain: Grain
) -> None:
    z, moved = pulls(noise, centre, grain)
    assert moved <= 2
    # where hardly anything varies, no window tells how little: the error is on the safe
    # side, at most five times what it is
    assert 0.2 < np.sqrt(np.mean(z**2)) < 1.35
    assert np.abs(z).max() < 5


def test_a_push_of_a_few_steps_is_still_seen() -> None:
    rng = np.random.default_rng(1)
    values = np.rint(rng.normal(0, 0.3, (N, 6)))
    values[700:720, 1] += 4
    with pytest.raises(Moved, match="disturbed 1[34]"):
        window(values * STEP, ROUNDED)


def test_a_device_that_says_nothing_is_judged_by_what_is_seen() -> None:
    rng = np.random.default_rng(2)
    values = rng.normal(0, 1e-3, (N, 6))
    one, other = window(values, None), window(values, Grain())
    np.testing.assert_array_equal(one.covariance, other.covariance)


def off(v: float, noise: float) -> float:
    """By how much the mean of what was cut toward zero and put in its middle is off."""
    k = np.arange(0, 60)
    # a value k + 1/2 for k < x < k + 1, except that of 0 < x < 1 nothing is left but 0
    up = ndtr((k + 1 - v) / noise) - ndtr((k - v) / noise)
    down = ndtr((-k - v) / noise) - ndtr((-k - 1 - v) / noise)
    middle = np.where(k > 0, k + 0.5, 0.0)
    return float(middle @ up - middle @ down - v)


def stated(mean: float, noise: float, grain: Grain = CUT) -> Array:
    """What is stated beside the rounding, in steps squared."""
    sampled = np.sqrt(noise**2 + 1 / 12) * STEP
    rounded = np.maximum(
        variance_of_mean(STEP, sampled), variance_of_few_values(STEP, sampled)
    )
    found = rounding_variance(grain, mean * STEP, sampled, 3 * STEP)
    return np.asarray((found - rounded) / STEP**2)


@pytest.mark.parametrize("noise", [0.6, 1.0])
@pytest.mark.parametrize("mean", [-2.5, -0.7, 0.0, 0.3, 1.2, 3.0])
def test_what_is_cut_is_off_around_zero_by_as_much_as_is_stated(
    mean: float, noise: float
) -> None:
    """With this noise rounding itself leaves nothing: all that is off is the zero."""
    expected = np.mean([off(mean + u, noise) ** 2 for u in MEAN_OFFSETS])
    np.testing.assert_allclose(stated(mean, noise), expected, rtol=0.02, atol=1e-6)


def test_far_from_zero_and_of_what_is_rounded_nothing_is_added() -> None:
    assert not stated(5.0, 0.3).any()
    assert not stated(0.0, 0.3, ROUNDED).any()
    # the reach of zero is two steps and three times the noise
    assert stated(2.9, 1.0).all() and not stated(5.1, 1.0).any()


def test_without_noise_the_variance_is_that_of_anywhere_within_two_steps() -> None:
    found = rounding_variance(CUT, np.zeros(6), np.zeros(6), STEP) / STEP**2
    # 1/3, of which the grid of 21 places tells 1/12 + 0.25 * 18/21
    np.testing.assert_allclose(found, 1 / 3, rtol=0.13)


def test_what_is_not_said_is_taken_as_it_is_seen() -> None:
    grain = Grain(acc=STEP[0], cut=True)
    seen = np.full(6, 0.5)
    found = rounding_variance(grain, np.full(6, np.nan), np.zeros(6), seen)
    np.testing.assert_allclose(found[3:], 0.25 / 12)
    np.testing.assert_allclose(found[:3], found[0])
    assert found[0] > STEP[0] ** 2 / 12
    # a step that is seen but not said leaves the mean of two values out of account
    sampled = np.full(6, 0.4 * 0.5)
    noisy = rounding_variance(Grain(), np.zeros(6), sampled, seen)
    np.testing.assert_allclose(noisy, variance_of_mean(seen, sampled))
    said = rounding_variance(Grain(0.5, 0.5), np.zeros(6), sampled, seen)
    np.testing.assert_allclose(
        said, np.maximum(noisy, variance_of_few_values(seen, sampled))
    )
    assert (said > 1.1 * noisy).all()


def test_steps_show_where_noise_does_not_hide_them_and_twice_as_wide_at_zero() -> None:
    mean = np.array([0.0, 1.9, 2.1, 0.0, -1.9, np.nan]) * STEP
    quiet, louder, loud = (s * STEP for s in (0.5, 1.4, 1.6))
    for grain, sampled, expected in [
        (ROUNDED, quiet, [1, 1, 1, 1, 1, 1]),
        (ROUNDED, louder, [0, 0, 0, 0, 0, 0]),
        (CUT, quiet, [2, 2, 1, 2, 2, 2]),
        (CUT, louder, [2, 2, 0, 2, 2, 2]),
        (CUT, loud, [0, 0, 0, 0, 0, 0]),
        (Grain(), quiet, [0, 0, 0, 0, 0, 0]),
        (Grain(cut=True), quiet, [0, 0, 0, 0, 0, 0]),
    ]:
        found = visible_step(grain, mean, sampled) / STEP
        np.testing.assert_allclose(found, expected)
    edge = visible_step(CUT, 2.0 * STEP, quiet) / STEP
    np.testing.assert_allclose(edge, 1.0)
    edge = visible_step(CUT, 0.0 * STEP, 1.5 * STEP) / STEP
    np.testing.assert_allclose(edge, 0.0)
