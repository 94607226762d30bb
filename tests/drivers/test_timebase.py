"""Times of samples: stamps, rates and arrivals, with what befalls clocks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.samples import Array
from fieldcal.drivers.arrival_timebase import ArrivalTimebase
from fieldcal.drivers.driver import LinkHealth
from fieldcal.drivers.stamp_timebase import StampTimebase
from fieldcal.drivers.timebase import RateTimebase


def placed(clock: StampTimebase, stamps: Array, host: Array | None = None) -> Array:
    steps = np.ones(len(stamps), dtype=int)
    return clock.times(stamps, steps, stamps * 0 if host is None else host)


def test_fine_stamps_stay_as_they_are() -> None:
    health = LinkHealth()
    stamps = 5 + np.cumsum(np.random.default_rng(0).uniform(0.009, 0.011, 9000))
    np.testing.assert_array_equal(placed(StampTimebase(health), stamps), stamps)
    assert health == LinkHealth()


@given(
    rate=st.floats(20, 2000),
    phase=st.floats(0, 1),
    cuts=st.lists(st.integers(1, 400), max_size=5),
    lost=st.sets(st.integers(20, 399), max_size=20),
)
def test_coarse_stamps_become_even_whatever_the_pieces(
    rate: float, phase: float, cuts: list[int], lost: set[int]
) -> None:
    truth = np.delete((np.arange(400) + phase) / rate, sorted(lost))
    stamps = np.floor(truth * 1000) / 1000
    whole = placed(StampTimebase(LinkHealth(), 1e-3), stamps)
    assert np.all(np.diff(whole) > 0)
    assert np.all(np.abs(whole - truth) < 1.01e-3)
    pieces = StampTimebase(LinkHealth(), 1e-3)
    parts = [placed(pieces, part) for part in np.split(stamps, sorted(cuts))]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_a_jittered_millisecond_clock_at_1_khz_loses_no_sample() -> None:
    rng = np.random.default_rng(2)
    truth = np.arange(60_000) / 1000
    stamps = np.floor((truth + rng.uniform(0, 2e-3, len(truth))) * 1000) / 1000
    health = LinkHealth()
    t = placed(StampTimebase(health, 1e-3), np.maximum.accumulate(stamps))
    assert not np.isnan(t).any()
    assert np.all(np.diff(t) > 0)
    assert health.repeated == health.gaps == 0


def test_missing_samples_are_counted_from_the_stamps() -> None:
    health = LinkHealth()
    stamps = np.delete(np.arange(1000) / 200, [100, 101, 500, 700, 701, 702])
    placed(StampTimebase(health), stamps)
    assert (health.gaps, health.missing) == (3, 6)


def test_a_gap_right_at_the_start_does_not_spoil_the_count() -> None:
    health = LinkHealth()
    stamps = np.delete(np.arange(1000) / 200, [*range(3, 60), 500])
    placed(StampTimebase(health), stamps)
    assert (health.gaps, health.missing) == (1, 1)


def test_old_stamps_are_dropped() -> None:
    health = LinkHealth()
    stamps = np.arange(100) / 100
    stamps[50], stamps[60] = stamps[49], stamps[57]
    t = placed(StampTimebase(health), stamps)
    assert np.flatnonzero(np.isnan(t)).tolist() == [50, 60]
    assert health.repeated == 2


def test_a_counter_is_unwrapped() -> None:
    counts = (2**32 - 700 + 10 * np.arange(200)) % 2**32
    t = placed(StampTimebase(LinkHealth(), span=2**32 * 1e-6), counts * 1e-6)
    np.testing.assert_allclose(np.diff(t), 1e-5, atol=1e-12)


@pytest.mark.parametrize("gap", [3.9, 6.5])
def test_a_counter_that_wrapped_during_an_outage_is_unwrapped_by_the_host(
    gap: float,
) -> None:
    """16 bits of 50 us: the span of 3.3 s is more than arrivals are ever late by."""
    span = 2**16 * 50e-6
    truth = np.arange(500) / 100
    truth = np.append(truth, truth + truth[-1] + gap) + 3 * span - truth[-1] + 0.01
    host = 1e9 + truth
    health = LinkHealth()
    t = placed(StampTimebase(health, span=span), truth % span, host)
    np.testing.assert_allclose(t - t[0], truth - truth[0], atol=1e-9)
    assert (health.restarts, health.gaps) == (0, 1)


@pytest.mark.parametrize("lead", [1.0, 100.0])
@pytest.mark.parametrize("span", [float("inf"), 2**32 * 1e-3])
def test_a_time_of_day_goes_on_over_midnight(span: float, lead: float) -> None:
    """Also in an outage, and just after the first sample; it is no restart."""
    health = LinkHealth()
    truth = 86400 - lead + np.delete(np.arange(20_000) / 100, range(9_950, 10_550))
    host = 1e9 + truth - truth[0]
    t = placed(StampTimebase(health, span=span), truth % 86400, host)
    np.testing.assert_allclose(t, truth, atol=1e-6)
    assert (health.restarts, health.gaps, health.missing) == (0, 1, 600)


@pytest.mark.parametrize("up", [86000.0, 86399.0, 90000.0])
def test_a_device_that_ran_about_a_day_may_be_restarted(up: float) -> None:
    """It was off for an hour, and begins at 0: no midnight makes that an hour."""
    health = LinkHealth()
    stamps = np.concatenate([up + np.arange(1000) / 100, np.arange(1000) / 100])
    host = np.concatenate([np.arange(1000) / 100, 3600 + np.arange(1000) / 100])
    t = placed(StampTimebase(health), stamps, host)
    assert health.restarts == 1
    assert t[1000] - t[999] == pytest.approx(3600 - 9.99)


@pytest.mark.parametrize("span", [float("inf"), 2**32 * 1e-6])
@pytest.mark.parametrize("up", [100.0, 3000.0])
def test_time_goes_on_over_a_reboot_by_what_the_host_saw(
    span: float, up: float
) -> None:
    health = LinkHealth()
    stamps = np.concatenate([up + np.arange(100) / 100, np.arange(100) / 100])
    host = np.concatenate([np.arange(100) / 100, 4 + np.arange(100) / 100])
    t = placed(StampTimebase(health, span=span), stamps, host)
    assert np.all(np.diff(t) > 0)
    assert t[100] - t[99] == pytest.approx(4 - 0.99)
    np.testing.assert_allclose(np.diff(t[100:]), 0.01, atol=1e-9)
    assert (health.restarts, health.gaps) == (1, 1)


def test_an_hour_unplugged_is_no_reboot() -> None:
    health = LinkHealth()
    stamps = np.concatenate([np.arange(100) / 100, 3600 + np.arange(100) / 100])
    t = placed(StampTimebase(health), stamps, stamps)
    np.testing.assert_array_equal(t, stamps)
    assert (health.restarts, health.gaps) == (0, 1)


def test_a_rate_goes_on_over_a_broken_link() -> None:
    health = LinkHealth()
    clock = RateTimebase(health, 100.0)
    ones, none = np.ones(10, dtype=int), np.full(10, np.nan)
    first = clock.times(none, ones, np.full(10, 50.0))
    clock.link_broken()
    second = clock.times(none, ones, np.full(10, 52.5))
    np.testing.assert_allclose(first, np.arange(10) / 100)
    np.testing.assert_allclose(second, 0.09 + 2.5 + np.arange(10) / 100)
    assert health.gaps == 1


def in_batches(clock: RateTimebase, sent: Array, arrived: Array, most: int) -> Array:
    """Feed samples as they arrive, several batches at a time."""
    parts = []
    for some in np.array_split(np.arange(len(sent)), max(1, len(sent) // most)):
        ones = np.ones(len(some), dtype=int)
        parts.append(clock.times(ones * np.nan, ones, arrived[some]))
    return np.concatenate(parts)


@pytest.mark.parametrize("most", [1, 7, 100_000])
def test_a_silent_device_is_a_gap_and_a_stalled_host_is_none(most: int) -> None:
    sent = np.arange(1000) / 100
    silent = sent + 2.5 * (sent >= 5)
    health = LinkHealth()
    t = in_batches(RateTimebase(health, 100.0), sent, silent + 7, most)
    assert health.gaps == 1 and abs(health.missing - 250) <= 1
    np.testing.assert_allclose(np.diff(t)[499], 2.51, atol=0.02)
    stalled = np.where((sent >= 5) & (sent < 7.5), 7.5, sent)
    health = LinkHealth()
    t = in_batches(RateTimebase(health, 100.0), sent, stalled + 7, most)
    if most > 250:  # else what waited is not seen together
        assert health.gaps == 0
        np.testing.assert_allclose(t, sent)


def test_a_device_that_does_not_run_in_real_time_is_not_judged_by_arrivals() -> None:
    health = LinkHealth()
    sent = np.arange(1000) / 100
    t = in_batches(RateTimebase(health, 100.0), sent, sent / 20 + 1.5 * (sent >= 5), 7)
    assert health.gaps == 0
    np.testing.assert_allclose(t, sent)


def arrive(
    clock: ArrivalTimebase, sent: Array, batch: int, rng: np.random.Generator
) -> Array:
    """Feed samples sent at these times in batches, each with a delay of its own."""
    parts = []
    for some in np.split(sent, range(batch, len(sent), batch)):
        host = np.full(len(some), some[-1] + rng.exponential(0.004))
        parts.append(clock.times(some * np.nan, np.ones(len(some), dtype=int), host))
    return np.concatenate(parts)


@pytest.mark.parametrize(("batch", "seeds"), [(1, 1), (7, 2)])
def test_arrivals_teach_the_rate_not_their_jitter(batch: int, seeds: int) -> None:
    errors, slopes = [], []
    for seed in range(seeds):
        sent = 1e9 + np.arange(12_000) / 201.3
        clock = ArrivalTimebase(LinkHealth())
        t = arrive(clock, sent, batch, np.random.default_rng(seed))
        known = ~np.isnan(t)
        assert known.mean() > 0.97
        assert np.all(np.diff(t[known]) > 0)
        late = t[-6000:] - sent[-6000:]
        errors.append(late.mean() - 0.004)
        slopes.append(np.polyfit(sent[-6000:] - sent[0], late, 1)[0])
    assert np.abs(errors).max() < 1e-3
    assert np.abs(slopes).max() < 100e-6


def test_lost_samples_show_in_the_arrivals() -> None:
    health = LinkHealth()
    sent = np.delete(np.arange(6000) / 100, range(3000, 3300))
    t = arrive(ArrivalTimebase(health), sent, 1, np.random.default_rng(0))
    assert (health.gaps, health.missing) == (1, 300)
    np.testing.assert_allclose(t[4000:], sent[4000:] + 0.004, atol=3e-3)


def test_a_passing_delay_is_no_gap() -> None:
    health = LinkHealth()
    sent = np.arange(6000) / 100
    host = sent + np.random.default_rng(0).exponential(0.002, 6000)
    host[3000:3020] = host[3020]
    t = ArrivalTimebase(health).times(sent * np.nan, np.ones(6000, dtype=int), host)
    assert health.gaps == 0
    np.testing.assert_allclose(t[200:], sent[200:] + 0.002, atol=4e-3)


def test_samples_that_a_counter_misses_are_counted_by_every_timebase() -> None:
    steps = np.ones(3000, dtype=int)
    steps[[1200, 1800]] = 501, 3
    host = np.cumsum(steps) / 100
    counts = []
    for made in (ArrivalTimebase, lambda health: RateTimebase(health, 100.0)):
        health = LinkHealth()
        clock = made(health)
        for i in range(0, 3000, 10):
            some = slice(i, i + 10)
            clock.times(np.full(10, np.nan), steps[some], host[some])
        counts.append((health.gaps, health.missing))
    assert counts == [(2, 502), (2, 502)]


SPANS = {"text, 32 bit of us": 2**32 * 1e-6, "u-blox, 24 bit": 655.36, "CAN": 65.536}
"""Times after which counters of devices wrap, s."""


def away(
    span: float, uptime: float, seconds: float, restarts: bool, speed: float = 1.0
) -> tuple[LinkHealth, float]:
    """The link's health, and the time that passed while a device was away.

    Before, it ran for 20 s of the host; its clock may run faster than the host's.
    """
    health, shift = LinkHealth(), 1e-3
    clock = StampTimebase(health, 0.0, span)
    n, each = 2000, 0.01 * speed
    t = uptime - n * each + each * np.arange(n)
    host = 1000.0 + (t - t[0]) / speed
    jitter = np.sort(np.random.default_rng(1).uniform(0.0, 0.05, n))
    first = clock.times(t % span, np.ones(n), host + jitter)
    begins = shift if restarts else uptime - each + seconds
    t = begins + each * np.arange(n)
    host = host[-1] + seconds / speed + (t - t[0]) / speed
    second = clock.times(t % span, np.ones(n), host + jitter[-1])
    assert (np.diff(np.concatenate([first, second])) > 0).all()
    return health, float(second[0] - first[-1])


@pytest.mark.parametrize(
    ("name", "share", "speed"),
    [(name, share, 1.0) for name in SPANS for share in (0.35, 0.6, 0.8, 0.9)]
    + [("text, 32 bit of us", share, 10.0) for share in (0.35, 0.6, 0.9)],
)
def test_a_restart_is_one_wherever_the_counter_is(
    name: str, share: float, speed: float
) -> None:
    span = SPANS[name]
    health, passed = away(span, share * span, 3.0, restarts=True, speed=speed)
    assert health.restarts == 1
    assert passed == pytest.approx(3.0 / speed, abs=0.1)


@pytest.mark.parametrize("span", SPANS.values(), ids=SPANS)
@pytest.mark.parametrize("spans", [0.1, 0.45, 0.6, 0.93, 1.001, 1.07, 2.5, 3.02])
def test_as_many_spans_pass_as_the_host_saw(span: float, spans: float) -> None:
    health, passed = away(span, 0.7 * span, spans * span, restarts=False)
    assert health.restarts == 0
    assert passed == pytest.approx(spans * span, rel=1e-3)


def test_what_waited_in_a_buffer_did_not_wrap() -> None:
    """Samples that come late, all at once, are those that were due before."""
    health = LinkHealth()
    clock = StampTimebase(health, 0.0, 65.536)
    t = np.arange(12_000) * 0.01
    host = 500.0 + t
    host[2000:5000] = host[5000]  # half a span, and more
    made = clock.times(t % 65.536, np.ones(len(t)), host)
    np.testing.assert_allclose(np.diff(made), 0.01, rtol=1e-6)
    assert (health.restarts, health.gaps, health.missing) == (0, 0, 0)


@pytest.mark.parametrize("span", [2**16 * 1e-6, 0.65536])
@pytest.mark.parametrize("stall", [0.1, 0.5, 1.5])
def test_short_spans_are_not_counted_by_late_arrivals(
    span: float, stall: float
) -> None:
    """A counter of 16 bits may wrap several times between two arrivals."""
    health = LinkHealth()
    t = np.arange(6000) * 0.01
    host = 500.0 + t
    for at in range(1000, 5000, 97):
        late = slice(at, at + round(100 * stall))
        host[late] = np.maximum(host[late], 500.0 + t[late.stop])
    made = StampTimebase(health, span=span).times(t % span, np.ones(len(t)), host)
    np.testing.assert_allclose(made, t, atol=1e-6)
    assert (health.restarts, health.gaps, health.missing) == (0, 0, 0)


def test_samples_that_overtake_each_other_are_no_wrap() -> None:
    health = LinkHealth()
    t = np.arange(6000) * 0.01
    stamps = t % 0.65536
    before = 2010  # in the middle of a span
    assert 0.1 < stamps[before] < 0.5
    stamps[[before, before + 1]] = stamps[[before + 1, before]]
    made = StampTimebase(health, span=0.65536).times(stamps, np.ones(len(t)), 500.0 + t)
    assert made[-1] == pytest.approx(t[-1])
    assert health.repeated == 1


@pytest.mark.parametrize(
    ("first", "span", "since_power_on", "shown"),
    [
        (5.0, float("inf"), True, True),
        (5.0, 4294.967296, True, True),
        (5.0, float("inf"), False, False),
        (1.7e9, float("inf"), True, False),  # seconds of the calendar
        (5.0, 65.536, True, False),  # a restart may look like a wrap
    ],
)
def test_a_clock_since_power_on_shows_every_restart(
    first: float, span: float, since_power_on: bool, shown: bool
) -> None:
    health = LinkHealth()
    clock = StampTimebase(health, span=span, since_power_on=since_power_on)
    placed(clock, first + np.arange(40) * 0.01)
    assert health.since_power_on is shown
