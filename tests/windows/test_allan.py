"""Allan deviations of noise whose deviation is known in closed form."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy.stats import chi2

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.windows import allan
from fieldcal.windows.allan import AllanDeviation, allan_deviation
from fieldcal.windows.rounding import variance_of_mean

RATE = 50.0


def still(seconds: float, walk: float = 0.0, seed: int = 0) -> Block:
    """White noise of 0.05 m/s^2, 0.002 rad/s, and a random walk on the gyroscopes."""
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    acc = [0, -9.81, 0] + 0.05 * rng.standard_normal((n, 3))
    steps = walk / np.sqrt(RATE) * rng.standard_normal((n, 3))
    gyr = 0.002 * rng.standard_normal((n, 3)) + np.cumsum(steps, axis=0)
    return Block.of(np.arange(n) / RATE, acc, gyr)


@pytest.mark.statistical
def test_white_noise_falls_with_the_root_of_time() -> None:
    ratios = []
    for seed in range(2):
        found = allan_deviation(still(900, seed=seed))
        truth = 0.05 / np.sqrt(RATE * found.tau)
        ratios.append(found.deviation[:, :3] / truth[:, None])
        inside = (found.low[:, :3] < truth[:, None]) & (
            truth[:, None] < found.high[:, :3]
        )
        assert inside.mean() > 0.4
        sigma = found.sigma_of_mean(30.0)
        assert sigma[:3] == pytest.approx(0.05 / np.sqrt(30 * RATE), rel=0.35)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.05)


@pytest.mark.statistical
def test_random_walk_tells_when_more_time_is_useless() -> None:
    """White N and walk K meet where N^2/tau = K^2 tau/3: here at 10 s."""
    density = 0.002 / np.sqrt(RATE)
    found = allan_deviation(still(1800, walk=np.sqrt(3) * density / 10))
    assert (found.best[3:] > 5).all() and (found.best[3:] < 22).all()
    at = found.sigma_of_mean(10.0)[3:]
    assert at == pytest.approx(np.sqrt(2 * density**2 / 10), rel=0.2)


def test_what_was_not_measured_is_nan_and_a_nan_is_bridged() -> None:
    block = still(300)
    block.gyr[:] = np.nan
    block.acc[100:110, 0] = np.nan
    found = allan_deviation(block)
    assert np.isnan(found.deviation[:, 3:]).all() and np.isnan(found.best[3:]).all()
    assert np.isfinite(found.deviation[:, :3]).all()


def test_no_mean_is_better_than_the_steps_of_the_outputs_allow() -> None:
    block = still(300)
    step = 0.5  # ten times the noise
    block.acc[:] = step * np.round((block.acc + [0.2, 0.0, 0.0]) / step)
    found = allan_deviation(block)
    assert np.ptp(block.acc[:, 0]) == step and np.ptp(block.acc[:, 2]) == 0
    assert found.sigma_of_mean(60.0)[2] == pytest.approx(step / np.sqrt(12))
    assert (found.sigma_of_mean(60.0)[3:] < 1e-4).all()


def test_what_cannot_be_told_is_refused() -> None:
    with pytest.raises(InputError, match="20 s is too short"):
        allan_deviation(still(20))
    block = still(200)
    late = np.where(block.t > 100, 7.0, 0.0)
    with pytest.raises(InputError, match=r"no samples for 7\.0 s from 100\.00 s"):
        allan_deviation(Block.of(block.t + late, block.acc))
    with pytest.raises(InputError, match="none of ax"):
        allan_deviation(Block.of(block.t, np.full((len(block), 3), np.nan)))
    with pytest.raises(InputError, match="record 400 s at rest"):
        allan_deviation(block).sigma_of_mean(100.0)


@pytest.mark.parametrize("rate", [0.5, 1.0])
def test_slow_samples_are_no_gaps(rate: float) -> None:
    """Of a logger, at its own uneven times."""
    rng = np.random.default_rng(3)
    t = (np.arange(1200) + rng.uniform(-0.05, 0.05, 1200)) / rate
    acc = 0.02 * rng.standard_normal((1200, 3))
    found = allan_deviation(Block.of(t, acc))
    at = int(np.argmin(np.abs(found.tau - 10 / rate)))
    white = 0.02 / np.sqrt(found.tau[at] * rate)
    np.testing.assert_allclose(found.deviation[at, :3], white, rtol=0.2)
    late = np.where(t > 600, 8.0 / rate, 0.0)
    with pytest.raises(InputError, match="no samples for"):
        allan_deviation(Block.of(t + late, acc))


def deviation_of(x: Array, m: int) -> float:
    """Root of half the mean square difference of neighbouring means of m, each one."""
    means = [x[k : k + m].mean() for k in range(len(x) - m + 1)]
    steps = [means[k + m] - means[k] for k in range(len(means) - m)]
    return float(np.sqrt(np.mean(np.square(steps)) / 2))


def test_deviations_are_those_of_overlapping_means() -> None:
    block = still(61, walk=1e-3)
    found = allan_deviation(block)
    m = np.round(found.tau * RATE).astype(int)
    np.testing.assert_allclose(found.tau, m / RATE, rtol=1e-9)
    for i in (0, len(m) // 2, len(m) - 1):
        for channel in (0, 5):
            slow = deviation_of(block.six[:, channel], m[i])
            assert found.deviation[i, channel] == pytest.approx(slow, rel=1e-6)
    assert (found.low < found.deviation).all() and (found.deviation < found.high).all()
    # of 30 000 differences more is known than of a few
    width = (found.high - found.low) / found.deviation
    assert (width[0] < 0.06).all() and (width[-1] > 0.5).all()


@pytest.mark.parametrize(("rate", "first"), [(50.0, 5), (8.0, 1), (2.0, 1)])
def test_durations_go_from_a_tenth_of_a_second_to_a_fourth_of_the_recording(
    rate: float, first: int
) -> None:
    n = int(200 * rate)
    acc = np.random.default_rng(0).standard_normal((n, 3))
    found = allan_deviation(Block.of(7.0 + np.arange(n) / rate, acc))
    assert found.tau[0] == pytest.approx(first / rate)
    assert found.tau[-1] == pytest.approx(50.0, rel=0.02)
    octaves = np.diff(np.log2(found.tau[-6:]))
    assert octaves == pytest.approx(1 / 3, abs=0.06)
    assert (np.diff(found.tau) > 0).all()


@pytest.mark.thorough
@pytest.mark.statistical
def test_the_interval_holds_as_often_as_it_says() -> None:
    """White noise in two of three recordings, as chi-squared tells it."""
    inside = []
    for seed in range(12):
        found = allan_deviation(still(100, seed=seed))
        i = int(np.argmin(np.abs(found.tau - 5.0)))
        truth = np.repeat([0.05, 0.002], 3) / np.sqrt(RATE * found.tau[i])
        inside += list((found.low[i] < truth) & (truth < found.high[i]))
    assert 0.5 < np.mean(inside) < 0.85


def test_the_interval_is_that_of_chi_squared_with_as_many_degrees_of_freedom() -> None:
    """White noise: Riley 2008, NIST SP 1065, table 5."""
    found = allan_deviation(still(100))
    n, m = 100 * RATE, np.round(found.tau * RATE)
    freedom = (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5)
    for bound, share in ((found.low, 0.8413), (found.high, 0.1587)):
        expected = np.sqrt(freedom / chi2.ppf(share, freedom))
        ratio = bound[:, 0] / found.deviation[:, 0]
        np.testing.assert_allclose(ratio[:-3] - 1, expected[:-3] - 1, rtol=0.12)


def made(deviation: list[float], rounding: float = 0.0) -> AllanDeviation:
    table = np.repeat(np.array(deviation)[:, None], 6, axis=1)
    tau = np.array([1.0, 10.0, 100.0])
    return AllanDeviation(tau, table, table, table, np.full(6, rounding))


def test_between_two_durations_the_deviation_is_a_power_of_time() -> None:
    found = made([1.0, 0.1, 0.1])
    assert found.sigma_of_mean(np.sqrt(10.0)) == pytest.approx(np.sqrt(0.1))
    assert found.sigma_of_mean(30.0) == pytest.approx(0.1)
    assert found.sigma_of_mean(1.0) == pytest.approx(1.0)
    assert found.sigma_of_mean(100.0) == pytest.approx(0.1)
    # the error of rounding is another one, and adds
    assert made([1.0, 0.3, 0.1], 0.4).sigma_of_mean(10.0) == pytest.approx(0.5)


def test_a_deviation_of_nothing_is_known_by_its_rounding_or_not_at_all() -> None:
    for none in (0.0, np.nan):
        assert made([none] * 3, 0.4).sigma_of_mean(10.0) == pytest.approx(0.4)
        assert np.isnan(made([none] * 3).sigma_of_mean(10.0)).all()


@pytest.mark.parametrize("seconds", [0.9, 101.0])
def test_a_duration_that_was_not_seen_is_refused(seconds: float) -> None:
    with pytest.raises(InputError) as told:
        made([1.0, 0.3, 0.1]).sigma_of_mean(seconds)
    assert str(told.value) == (
        f"the recording tells the error of means over 1 to 100 s, not {seconds:g} s: "
        f"record {4 * seconds:.0f} s at rest"
    )


def test_the_best_time_is_the_one_of_the_least_deviation() -> None:
    assert (made([1.0, 0.1, 0.3]).best == 10.0).all()
    assert (made([1.0, np.nan, 0.3]).best == 100.0).all()
    assert np.isnan(made([np.nan] * 3).best).all()


def test_missing_values_are_laid_between_their_neighbours() -> None:
    block = still(61)
    gaps = block.acc.copy()
    gaps[100:103, 0] = np.nan
    gaps[7, 1] = np.inf
    whole = block.acc.copy()
    whole[100:103, 0] = np.linspace(whole[99, 0], whole[103, 0], 5)[1:-1]
    whole[7, 1] = (whole[6, 1] + whole[8, 1]) / 2
    bridged = allan_deviation(Block.of(block.t, gaps))
    expected = allan_deviation(Block.of(block.t, whole))
    np.testing.assert_allclose(bridged.deviation, expected.deviation)


def test_a_channel_of_which_half_is_missing_is_not_judged() -> None:
    block = still(61)
    block.acc[::2, 0] = np.nan
    block.acc[::3, 1] = np.nan
    found = allan_deviation(block)
    assert np.isnan(found.deviation[:, 0]).all()
    assert np.isfinite(found.deviation[:, 1:]).all()


def test_the_rounding_is_that_of_the_finest_step_of_the_sensor() -> None:
    block = still(61)
    block.acc[:] = np.round(block.acc / 0.1) * 0.1
    block.gyr[:] = 0.25
    found = allan_deviation(block)
    noise = np.sqrt(np.mean(np.diff(block.acc, axis=0) ** 2, axis=0) / 2)
    expected = np.sqrt(variance_of_mean(np.full(3, 0.1), noise))
    np.testing.assert_allclose(found.rounding[:3], expected)
    assert (found.rounding[:3] > 0).all() and not found.rounding[3:].any()


def test_a_step_that_shows_late_is_found() -> None:
    t = np.arange(6000) / 50
    acc = np.zeros((6000, 3))
    acc[1000, 0] = 2.0
    acc[5000, 0] = 0.5
    found = allan_deviation(Block.of(t, acc))
    assert found.rounding[1] == pytest.approx(0.5 / np.sqrt(12))


def test_a_minute_is_enough_and_a_second_no_gap() -> None:
    block = still(60.04)
    assert block[:3001].t[-1] == 60.0
    assert allan_deviation(block[:3001]).tau[-1] == pytest.approx(15.0, rel=0.02)
    for shift in (-100.0, 100.0):
        later = Block.of(block.t[:-2] + shift, block.acc[:-2])
        with pytest.raises(InputError, match="too short"):
            allan_deviation(later[:-1])
        assert allan_deviation(Block.of(block.t + shift, block.acc)).tau[
            0
        ] == pytest.approx(0.1)
    assert allan_deviation(block).tau[-1] == pytest.approx(15.0, rel=0.02)
    late = Block.of(block.t + np.where(block.t > 30, 0.98, 0.0), block.acc)
    assert allan_deviation(late).tau[-1] == pytest.approx(15.0, rel=0.05)
    with pytest.raises(InputError) as told:
        allan_deviation(block[:-10])
    assert str(told.value) == (
        "a recording of 60 s is too short for an Allan deviation: "
        "record 60 s or more at rest"
    )
    with pytest.raises(InputError, match="^a recording of 0 s is too short"):
        allan_deviation(block[:0])


def test_a_gap_is_told_with_its_place_and_what_to_do() -> None:
    block = still(90)
    late = np.where(block.t > 20, 2.0, 0.0) + np.where(block.t > 70, 7.0, 0.0)
    with pytest.raises(InputError) as told:
        allan_deviation(Block.of(block.t + late, block.acc))
    assert str(told.value) == (
        "no samples for 7.0 s from 72.00 s on: take the part of the recording before "
        "or after"
    )
    with pytest.raises(InputError) as told:
        allan_deviation(Block.of(block.t, np.full((len(block), 3), np.nan)))
    assert str(told.value) == "none of ax, ay, az, gx, gy, gz was measured"


def test_without_allantools_it_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "allantools", None)
    with pytest.raises(InputError) as told:
        allan_deviation(still(61))
    assert str(told.value) == (
        "Allan deviations need allantools: pip install 'fieldcal[allan]'"
    )
    assert allan.MIN_RECORDING_S == 60.0
