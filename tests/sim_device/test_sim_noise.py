"""Random errors by their Allan deviations, and the temperature."""

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.sim_device.noise import RandomErrors
from fieldcal.sim_device.profile import ONE, ZERO, Climate, NoiseFigures
from fieldcal.sim_device.random_process import GaussMarkov, Walk
from fieldcal.sim_device.temperature import recorded_climate, temperature_course

RATE = 10.0
QUIET = NoiseFigures(ZERO, ZERO, acc_instability=ZERO, gyr_instability=ZERO)
SPANS = np.array([1.0, 4.0, 16.0, 64.0])


def allan(x: Array, span: float) -> float:
    """Allan deviation of (channels, n) at a span in s, channels pooled."""
    m = round(span * RATE)
    n = x.shape[1] // m * m
    means = x[:, :n].reshape(len(x), -1, m).mean(axis=2)
    return float(np.sqrt(np.mean(np.diff(means, axis=1) ** 2) / 2))


def deviations(x: Array) -> Array:
    return np.array([allan(x, span) for span in SPANS])


def test_white_noise_falls_with_the_root_of_the_span() -> None:
    figures = NoiseFigures((0.3,) * 3, (0.3,) * 3)
    x = RandomErrors(figures, RATE, 1, np.ones(6)).white(50_000)
    expected = 0.3 / np.sqrt(RATE * SPANS)
    np.testing.assert_allclose(deviations(x), expected, rtol=0.06)


def test_white_noise_can_be_given_by_its_density() -> None:
    figures = NoiseFigures(acc_density=(0.1,) * 3, gyr_density=(0.1,) * 3)
    x = RandomErrors(figures, RATE, 1, np.ones(6)).white(20_000)
    np.testing.assert_allclose(x.std(axis=1), 0.1 * np.sqrt(RATE), rtol=0.03)


def test_a_random_walk_rises_with_the_root_of_the_span() -> None:
    x = Walk(np.full(6, 0.02), RATE, np.random.default_rng(3)).draw(100_000)
    expected = 0.02 * np.sqrt(SPANS / 3)
    np.testing.assert_allclose(deviations(x), expected, rtol=0.12)


def test_a_walk_of_the_profile_is_the_same_process() -> None:
    figures = NoiseFigures(
        ZERO, ZERO, acc_instability=ZERO, gyr_instability=ZERO, acc_walk=ONE
    )
    x = RandomErrors(figures, RATE, 3, np.ones(6)).slow(100_000)
    assert not x[3:].any()
    np.testing.assert_allclose(deviations(x[:3]), np.sqrt(SPANS / 3), rtol=0.15)


def test_a_gauss_markov_bias_has_its_variance_and_forgets() -> None:
    tau = 5.0
    rng = np.random.default_rng(5)
    x = GaussMarkov(np.full(6, 0.2), tau, RATE, rng).draw(200_000)
    assert x.std() == pytest.approx(0.2, rel=0.03)
    lag = round(tau * RATE)
    kept = np.mean(x[:, lag:] * x[:, :-lag]) / x.var()
    assert kept == pytest.approx(np.exp(-1), abs=0.03)
    starts = [
        GaussMarkov(np.ones(6), tau, RATE, np.random.default_rng(k)).draw(1)[:, 0]
        for k in range(200)
    ]
    assert np.std(starts) == pytest.approx(1, rel=0.1)


def test_flicker_keeps_its_allan_deviation_over_two_decades() -> None:
    figures = NoiseFigures(
        ZERO, ZERO, acc_instability=ZERO, gyr_instability=ZERO,
        acc_flicker=ONE, gyr_flicker=ONE,
    )  # fmt: skip
    x = RandomErrors(figures, RATE, 8, np.ones(6)).slow(200_000)
    spans = np.array([8.0, 32.0, 128.0, 512.0])
    found = np.array([allan(x, span) for span in spans])
    np.testing.assert_allclose(found, 1.0, rtol=0.12)


@pytest.mark.parametrize("pieces", [[100] * 10, [1, 63, 64, 65, 807], [1000]])
def test_noise_is_the_same_in_any_pieces(pieces: list[int]) -> None:
    def noise() -> RandomErrors:
        figures = NoiseFigures(acc_walk=ONE, acc_flicker=ONE)
        return RandomErrors(figures, RATE, 2, np.ones(6))

    one, other = noise(), noise()
    whole = one.slow(1000)
    parts = [other.slow(n) for n in pieces]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)


def test_the_device_warms_up_in_air_that_warms_up() -> None:
    climate = Climate(20.0, 0.01, 5.0, 100.0)
    degrees, rate = temperature_course(climate, np.array([-5.0, 0.0, 100.0, 1e6]))
    np.testing.assert_allclose(
        degrees, [20, 20, 21 + 5 * (1 - np.exp(-1)), 20 + 1e4 + 5]
    )
    np.testing.assert_allclose(rate[1:], [0.06, 0.01 + 0.05 * np.exp(-1), 0.01])


def test_the_air_follows_points() -> None:
    climate = Climate(self_heating_k=0.0, points=((0.0, 20.0), (10.0, 30.0)))
    degrees, rate = temperature_course(climate, np.array([0.0, 5.0, 20.0]))
    np.testing.assert_allclose(degrees, [20, 25, 30])
    np.testing.assert_allclose(rate, [1, 1, 0])


def test_a_recorded_temperature_stands_in() -> None:
    t = np.arange(0, 600, 0.1)
    true = 20 + 0.01 * t
    measured = true + np.random.default_rng(1).normal(0, 0.1, len(t))
    measured[100:400] = np.nan
    climate = recorded_climate(Climate(), t, measured)
    degrees, rate = temperature_course(climate, t)
    assert np.abs(degrees - true)[50:-50].max() < 0.08
    assert rate[50:-50].mean() == pytest.approx(0.01, rel=0.05)
    assert recorded_climate(Climate(), t, np.full(len(t), np.nan)) == Climate()
