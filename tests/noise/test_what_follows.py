"""What follows from noise: averaging, filters, recalibration, north."""

from __future__ import annotations

import math

import numpy as np
import pytest
from few_channels import only
from scipy.signal import lfilter
from scipy.special import ndtr

from benchmarks.noise.processes import noise, recording
from fieldcal.core.frames import EARTH_RATE
from fieldcal.noise import estimate_noise, reduce_recording
from fieldcal.noise.alignment import gyrocompass_heading
from fieldcal.noise.averaging import averaging_error
from fieldcal.noise.filters import (
    FilterNoisePair,
    kalibr_parameters,
    noisiest_axes,
    program_parameters,
    ros_covariances,
)
from fieldcal.noise.history_walk import SHARES, WALKS, EarlierBias, walk_from_history
from fieldcal.noise.prediction import SizeDraw
from fieldcal.noise.recalibration import MAX_INTERVAL_S, recalibration_time

DAY = 86400.0


def drawn(**sizes: float) -> tuple[SizeDraw, ...]:
    """One draw: processes exactly so large."""
    terms = tuple(sizes)
    return (SizeDraw(terms, 2 * np.log(list(sizes.values()))),)


def monthly(
    rng: np.random.Generator, count: int, walk: float, sigma: float, common: float = 0.0
) -> list[EarlierBias]:
    """Calibrations a month apart, a share of their variance common to all."""
    walked = walk * math.sqrt(30 * DAY) * np.cumsum(rng.standard_normal(count))
    alike = math.sqrt(common) * rng.standard_normal()
    own = math.sqrt(1 - common) * rng.standard_normal(count)
    values = walked + sigma * (alike + own)
    return [EarlierBias(30 * DAY * i, v, sigma**2) for i, v in enumerate(values)]


def test_averaging_is_best_where_white_noise_and_walk_meet() -> None:
    """N^2/T = K^2 T/3 at T = sqrt(3) N/K; twice the white part there."""
    found = averaging_error(drawn(N=1.0, K=0.05), 0.0, 0.01, 4000.0)
    meet = math.sqrt(3) / 0.05
    assert found.best[0] == pytest.approx(meet, rel=0.2)
    assert found.white_until[0] == pytest.approx(meet, rel=0.4)
    assert found.at(30.0)[0] == pytest.approx(
        math.sqrt(1 / 30 + 0.05**2 * 10), rel=0.01
    )


def test_white_noise_is_worth_averaging_for_longer_than_is_known() -> None:
    found = averaging_error(drawn(N=1.0), 0.0, 0.01, 400.0)
    assert found.best[0] == math.inf and found.white_until[0] == math.inf
    assert found.seconds[-1] == pytest.approx(400.0, rel=0.02)


def test_a_ramp_ends_averaging() -> None:
    """N^2/T + R^2 T^2/2 is least at T^3 = N^2 / R^2."""
    found = averaging_error(drawn(N=1.0), 1e-3, 0.01, 4000.0)
    assert found.best[0] == pytest.approx(100.0, rel=0.2)


@pytest.mark.thorough
@pytest.mark.statistical
def test_the_stated_walk_is_not_exceeded_in_95_of_100() -> None:
    """Where walk is too small to be seen, the bound lies above it nearly always."""
    rng = np.random.default_rng(30)
    above = []
    for _ in range(6):
        values = noise(rng, 3000, 0.1, 6, N=1.0, K=0.004)
        for channel in estimate_noise(
            [reduce_recording([recording(values, 0.1)])]
        ).channels.values():
            pair = channel.pair
            bound = pair.walk + 1.645 * np.nan_to_num(pair.walk_sigma)
            above.append(bound > 0.004)
            assert pair.white / pair.left_out == pytest.approx(1.0, rel=0.1)
    assert np.mean(above) > 0.9


def test_two_numbers_are_as_much_larger_as_what_they_leave_out() -> None:
    """A bump in the Allan deviation that no sum of two slopes has."""
    values = noise(np.random.default_rng(31), 60_000, 0.1, 6, N=1.0, s=0.6, T=20.0)
    block = recording(only(values, 2, 3), 0.1)
    found = estimate_noise([reduce_recording([block])]).channels
    assert list(found) == ["az", "gx"]
    for channel in found.values():
        pair, tau = channel.pair, np.geomspace(1, 1500, 30)
        covered = pair.white**2 / tau + pair.walk**2 * tau / 3
        u = tau / 20.0
        markov = 2 * 0.36 / u * (1 - (3 - 4 * np.exp(-u) + np.exp(-2 * u)) / (2 * u))
        assert 1.0 < pair.left_out < 2.5
        assert (covered > 0.8 * (1 / tau + markov)).all()


def test_the_noisiest_axis_of_a_triad_counts() -> None:
    pairs = {
        "gx": FilterNoisePair(2.0, 0.2, 1.0, 0.1, 1.1),
        "gy": FilterNoisePair(1.0, 0.1, 3.0, math.nan, 1.3),
    }
    found = noisiest_axes(pairs, "g")
    assert found and (found.white, found.walk, found.left_out) == (2.0, 3.0, 1.3)
    assert noisiest_axes(pairs, "a") is None
    assert set(kalibr_parameters(pairs)) == {"gyroscope_noise_density",
                                             "gyroscope_random_walk"}  # fmt: skip
    for program, step in (("ardupilot", 0.012), ("px4", 0.01)):
        values = [v for v, _, _ in program_parameters(program, pairs).values()]
        assert values == pytest.approx([2 / math.sqrt(step), 3 / math.sqrt(step)])
    told = ros_covariances({"gy": (1e-3, 1e-5)}, 200.0)
    assert told["angular_velocity_covariance[4]"][:2] == pytest.approx((2e-4, 4e-6))


@pytest.mark.statistical
def test_a_walk_leaves_its_limit_when_it_is_said_to() -> None:
    """The chance at the date, counted among simulated walks."""
    k, limit = 1e-6, 5e-4
    found = recalibration_time(drawn(N=1e-9, K=k), 0.0, limit, 0.0)
    rng = np.random.default_rng(32)
    for chance, seconds in zip((0.05, 0.32), found.seconds, strict=True):
        walks = k * math.sqrt(seconds) * rng.standard_normal(20_000)
        assert np.mean(np.abs(walks) > limit) == pytest.approx(chance, rel=0.2)
    assert not found.from_history


def test_what_returns_leaves_its_limit_by_as_much_as_it_has() -> None:
    """A Gauss-Markov process changes by a variance of 2 s^2 (1 - exp(-t/T))."""
    s, time, limit = 1e-4, 5e4, 2e-4
    known = (SizeDraw(("N", "G"), np.log([1e-18, s**2, time])),)
    found = recalibration_time(known, 0.0, limit, 0.0).seconds[0]
    assert found == pytest.approx(
        -time * math.log(1 - (limit / 1.96 / s) ** 2 / 2), rel=0.15
    )
    assert recalibration_time(known, 0.0, 1.96 * 1.5 * s, 0.0).seconds[0] == math.inf


def test_flicker_up_to_a_time_changes_no_more_behind_it() -> None:
    """Each e-fold of its correlation times, from 30 s on, has B^2 / pi."""
    time = 1e4
    known = (SizeDraw(("N", "BT"), np.log([1e-18, 1.0, time])),)
    most = math.sqrt(2 / math.pi * math.log(time / 30))
    inside, beyond = (
        recalibration_time(known, 0.0, 1.96 * part * most, 0.0).seconds[0]
        for part in (0.95, 1.05)
    )
    assert 0.2 * time < inside < 2 * time and beyond == math.inf


@pytest.mark.parametrize("time", [0.06, 3.0, 300.0, 3e4])
def test_a_bias_is_a_mean_and_no_single_sample(time: float) -> None:
    """What changes are means over 30 s, counted; a filter's process is white noise."""
    s, step, n = 1e-3, 3.0, 4_000_000
    rng, rho = np.random.default_rng(33), math.exp(-step / time)
    white = s * math.sqrt(1 - rho**2) * rng.standard_normal(n)
    means = lfilter([1.0], [1.0, -rho], white).reshape(-1, 10).mean(axis=1)
    if time < step:  # means over a step, which are independent
        means *= math.sqrt(2 * time / step)
    known = (SizeDraw(("N", "G"), np.log([1e-18, s**2, time])),)
    # the variance of the calibration is that of such a mean; the later one has as much
    alone = np.var(np.diff(means)) / 2
    for lag in (20, 2000):
        change = np.std(means[lag:] - means[:-lag])
        spread = math.sqrt(change**2 - alone)
        for limit, past in ((1.96 * spread * 1.15, False), (1.96 * spread / 1.1, True)):
            found = recalibration_time(known, 0.0, limit, float(alone)).seconds[0]
            assert (found <= 30 * lag * 1.2) is past, (lag, limit, found)


def test_a_ramp_leaves_its_limit_on_a_day() -> None:
    found = recalibration_time(drawn(N=1e-9), 1e-9, 1e-4, 1e-14)
    assert found.seconds == pytest.approx((1e5, 1e5), rel=0.2)
    assert recalibration_time(drawn(N=1e-9), 0.0, 1.0, 1e-14).seconds == (math.inf,) * 2


def test_a_ramp_that_goes_on_is_told_from_a_walk_that_was_not_seen() -> None:
    found = recalibration_time(drawn(N=1e-9), 1e-9, 1e-4, 1e-14, unseen=1e-9)
    assert found.by_ramp and found.seconds[0] == pytest.approx(1e5, rel=0.15)
    slow = recalibration_time(drawn(N=1e-9), 1e-13, 5e-4, 0.0, unseen=1e-6)
    assert slow.by_unseen_walk and not slow.by_ramp
    never = recalibration_time(drawn(N=1e-9), 1e-16, 1e-4, 1e-14)
    assert never.seconds == (math.inf,) * 2 and not never.by_ramp


def test_a_walk_that_would_not_be_seen_counts_where_none_is() -> None:
    seen = recalibration_time(drawn(N=1e-9, K=1e-6), 0.0, 5e-4, 0.0, unseen=1e-5)
    none = recalibration_time(drawn(N=1e-9), 0.0, 5e-4, 0.0, unseen=1e-6)
    assert none.seconds == pytest.approx(seen.seconds)
    assert none.by_unseen_walk and not seen.by_unseen_walk
    # 1.96 K sqrt(t) = limit
    assert none.seconds[0] == pytest.approx((5e-4 / 1.96e-6) ** 2, rel=0.15)


def test_what_history_shows_counts_more_than_an_hour() -> None:
    rng = np.random.default_rng(33)
    k = 1e-7
    earlier = monthly(rng, 401, k, 1e-6)
    assert np.sqrt(walk_from_history(earlier)) == pytest.approx(k, rel=0.15)
    found = recalibration_time(drawn(N=1e-6, K=1e-5), 1e-6, 1e-3, 0.0, earlier)
    assert found.from_history
    # 1.96 k sqrt(t) = limit
    assert found.seconds[0] == pytest.approx((1e-3 / 1.96 / k) ** 2, rel=0.25)


@pytest.mark.statistical
@pytest.mark.parametrize("count", [4, 6])
@pytest.mark.parametrize("common", [0.0, 0.9])
@pytest.mark.parametrize("walk", [0.5, 1.0, 2.0])
def test_errors_of_a_few_calibrations_hide_no_walk(
    count: int, common: float, walk: float
) -> None:
    """The chance to be beyond the limit at the dates is hardly more than is said."""
    rng, sigma, limit = np.random.default_rng(34), 0.004, 0.02
    k = walk * sigma / math.sqrt(30 * DAY)
    chances = []
    for _ in range(60):
        earlier = monthly(rng, count, k, sigma, common)
        dates = recalibration_time(drawn(N=1e-9), 0.0, limit, 0.0, earlier).seconds
        at = np.minimum(dates, MAX_INTERVAL_S)
        chances.append(2 * ndtr(-limit / k / np.sqrt(at)))
    assert (np.mean(chances, axis=0) < (0.15, 0.5)).all()


def test_the_walk_of_a_history_has_the_density_of_its_changes() -> None:
    """Against the dense covariance of the changes, times unevenly apart."""
    times, values, sigma = np.array([0.0, 1.0, 4.0, 9.0]), [0.0, 2.0, 1.0, 6.0], 0.8
    variances = sigma**2 * np.array([1.0, 2.0, 0.5, 1.0])
    d = np.diff(np.eye(4), axis=0)
    sizes, off = np.geomspace(1e-6, 1e5, 2000), d @ values
    density = np.zeros(len(sizes))
    for share, prior in SHARES.items():
        for j, size in enumerate(sizes):
            grown = size * np.diag(np.diff(times))
            whole = grown + (1 - share) * (d * variances) @ d.T
            part = np.linalg.solve(whole, grown)
            p = prior * np.sqrt(np.trace(part @ part) / np.linalg.det(whole))
            density[j] += p * np.exp(-0.5 * off @ np.linalg.solve(whole, off))
    below = np.cumsum(density)
    expected = np.interp((np.arange(WALKS) + 0.5) / WALKS, below / below[-1], sizes)
    earlier = [EarlierBias(*row) for row in zip(times, values, variances, strict=True)]
    np.testing.assert_allclose(walk_from_history(earlier), expected, rtol=0.1)


def test_summer_and_winter_are_no_walk() -> None:
    """Ten calibrations, every second 15 K warmer, of a device with 1e-3 a kelvin."""
    warm = 15.0 * (np.arange(10) % 2 - 0.5)
    found = []
    for told in (warm, np.zeros(10)):
        rng = np.random.default_rng(3)
        plain = monthly(rng, 10, 1e-7, 1e-4)
        earlier = [
            EarlierBias(one.seconds, one.value + 1e-3 * k, one.variance, 1e-3 * w)
            for one, k, w in zip(plain, warm, told, strict=True)
        ]
        found.append(float(np.median(walk_from_history(earlier))) ** 0.5)
    known, unknown = found
    assert known < 3e-7 and unknown > 2e-6, "1e-7 an s^1/2 is true"


@pytest.mark.statistical
def test_the_walk_beside_a_coefficient_is_as_likely_as_stated() -> None:
    rng, ranks = np.random.default_rng(5), []
    for _ in range(200):
        plain, warm = monthly(rng, 8, 1e-7, 1e-4), rng.uniform(-15, 15, 8)
        coefficient = 1e-3 * rng.standard_normal()
        earlier = [
            EarlierBias(
                one.seconds, one.value + coefficient * k, one.variance, 1e-3 * k
            )
            for one, k in zip(plain, warm, strict=True)
        ]
        ranks.append(float((walk_from_history(earlier) < 1e-14).mean()))
    assert 0.02 < np.mean(np.array(ranks) > 0.9) < 0.18
    assert 0.02 < np.mean(np.array(ranks) < 0.1) < 0.18


def test_north_is_as_sure_as_the_worst_gyroscope_is_still() -> None:
    good, bad = (averaging_error(drawn(N=n), 0.0, 0.01, 1000.0) for n in (1e-7, 1e-6))
    found = gyrocompass_heading([good, bad], math.radians(60))
    assert found is not None
    seconds, sigma, spread = found.best
    expected = 1e-6 / math.sqrt(seconds) / (EARTH_RATE * 0.5)
    assert seconds == pytest.approx(1000.0, rel=0.02)
    assert sigma == pytest.approx(expected, rel=0.01)
    assert spread == pytest.approx(0.0, abs=1e-9)


def test_at_a_pole_no_gyroscope_finds_north() -> None:
    good = averaging_error(drawn(N=1e-7), 0.0, 0.01, 1000.0)
    assert gyrocompass_heading([good], math.radians(89.9)) is not None
    assert gyrocompass_heading([good], math.pi / 2) is None
