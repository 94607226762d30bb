"""The device's clock against the host's: pulls over many seeds."""

import numpy as np

from fieldcal.drivers.clock_comparison import MOST_STRETCHES, ClockComparison
from fieldcal.drivers.driver import LinkHealth


def heard(ppm: float, seed: int, seconds: float = 300.0) -> ClockComparison:
    """A device 1 h up, 100 Hz, arrivals delayed at random and now and then stuck."""
    rng = np.random.default_rng(seed)
    host = 1.7e9 + np.arange(0, seconds, 0.01)
    t = 3600 + (host - host[0]) * (1 + ppm * 1e-6)
    delay = 0.002 + rng.exponential(0.003, len(t))
    delay += 0.2 * (rng.random(len(t)) < 0.01)
    skew = ClockComparison(LinkHealth())
    for part in np.array_split(np.arange(len(t)), 25):
        skew.add(t[part], (host + delay)[part])
    return skew


def test_the_error_is_what_is_stated() -> None:
    pulls = []
    for seed in range(60):
        line = heard(35.0, seed).fit()
        assert line is not None
        assert line.sigma_ppm < 1.0
        pulls.append((line.fast_ppm - 35.0) / line.sigma_ppm)
    assert abs(np.mean(pulls)) < 3 / np.sqrt(60)
    assert 0.75 < np.std(pulls) < 1.3


def test_the_offset_is_that_of_the_least_delay() -> None:
    line = heard(-120.0, 1).fit()
    assert line is not None
    device = 3600 + 150 * (1 - 120e-6)
    host = line.offset_s + device / (1 + line.fast_ppm * 1e-6)
    assert abs(host - (1.7e9 + 150 + 0.002)) < 1e-3


def test_memory_is_bounded_and_hours_are_fitted() -> None:
    skew = ClockComparison(LinkHealth())
    t = np.arange(0, 20_000, 0.5)
    skew.add(t, t * (1 + 20e-6) + 5)
    assert len(skew._least) <= MOST_STRETCHES
    line = skew.fit()
    assert line is not None
    assert abs(line.fast_ppm + 20) < 1e-2


def test_too_little_says_nothing() -> None:
    skew = ClockComparison(LinkHealth())
    skew.add(np.arange(5.0), np.full(5, np.nan))
    skew.add(np.arange(5.0), np.arange(5.0))
    assert skew.fit() is None


def test_the_line_is_shown_and_begins_anew_with_the_clock() -> None:
    health = LinkHealth()
    skew = ClockComparison(health)
    t = np.arange(0, 30, 0.01)
    skew.add(t, t + 100)
    assert health.clock is not None
    assert abs(health.clock.offset_s - 100) < 1e-6
    health.restarts += 1
    skew.add(t, t + 900)
    assert health.clock is not None
    assert abs(health.clock.offset_s - 900) < 1e-6


def test_times_fitted_to_the_arrivals_show_no_clock() -> None:
    health = LinkHealth(clocked=False)
    t = np.arange(0, 30, 0.01)
    ClockComparison(health).add(t, t)
    assert health.clock is None
