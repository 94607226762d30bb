"""Estimates beside the Cramer-Rao bound, and what must not disturb them."""

from __future__ import annotations

import numpy as np
import pytest
from few_channels import only
from scipy.signal import butter, lfilter

from benchmarks.noise.processes import bound, covariance, noise, recording
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.noise import estimate_noise, reduce_recording
from fieldcal.noise.levels import CosineLevels
from fieldcal.noise.likelihood import Powers, fit_processes
from fieldcal.noise.spectrum import CosineSpectrum

DT = 0.1


def fits(values: Array, sizes: dict[str, float]) -> tuple[Array, Array]:
    """Relative errors of the sizes, (c, p), and stated ones."""
    levels = CosineLevels(DT, values.shape[1], values.shape[1])
    levels.add(values)
    spectrum = CosineSpectrum([levels.reduced()], values.shape[1])
    start = 2 * np.log(list(sizes.values()))
    errors, stated = [], []
    for c in range(values.shape[1]):
        one = np.ones(len(spectrum.last.bin))
        power, count = spectrum.channel_powers(c, spectrum.last.values[:, c], one)
        powers = Powers(power, count, np.zeros(len(power), dtype=bool))
        if found := fit_processes(spectrum, powers, tuple(sizes), start):
            errors.append((found.x - start) / 2)
            stated.append(np.sqrt(np.diag(found.covariance)) / 2)
    assert len(errors) > 0.95 * values.shape[1]
    return np.array(errors), np.array(stated)


@pytest.mark.statistical
@pytest.mark.parametrize(
    "sizes",
    [
        {"N": 1.0, "K": 1.0},
        pytest.param({"N": 1.0, "B": 1.0}, marks=pytest.mark.thorough),
        {"N": 1.0, "Q": 0.3},
    ],
    ids=["walk", "flicker", "quantisation"],
)
def test_estimates_are_as_good_as_any_can_be(sizes: dict[str, float]) -> None:
    rng = np.random.default_rng(4)
    whole = sum(s**2 * covariance(600, DT, p) for p, s in sizes.items())
    values = np.linalg.cholesky(whole) @ rng.standard_normal((600, 100))
    errors, stated = fits(values, sizes)
    best = bound(600, DT, sizes)
    # of 100, a root mean square is known to 7 %
    assert np.sqrt(np.mean(errors**2, axis=0)) == pytest.approx(best, rel=0.2)
    assert np.std(errors / stated, axis=0) == pytest.approx(1.0, abs=0.18)


@pytest.mark.statistical
def test_long_recordings_are_known_as_well_as_their_levels_allow() -> None:
    """White noise of n samples is known to 1 / sqrt(2 n)."""
    sizes = {"N": 1.0, "K": 0.05}
    values = noise(np.random.default_rng(5), 60_000, DT, 40, **sizes)
    errors, stated = fits(values, sizes)
    assert stated[:, 0].mean() == pytest.approx(1 / np.sqrt(2 * 60_000), rel=0.25)
    assert np.std(errors / stated, axis=0) == pytest.approx(1.0, abs=0.3)
    assert np.abs(errors.mean(axis=0)) == pytest.approx(0, abs=0.06)


@pytest.mark.statistical
def test_processes_that_are_there_are_named_and_no_others() -> None:
    rng = np.random.default_rng(6)
    values = np.hstack(
        [
            noise(rng, 20_000, DT, 2, N=1.0),
            noise(rng, 20_000, DT, 2, N=1.0, K=0.1),
            noise(rng, 20_000, DT, 2, N=1.0, B=1.0),
        ]
    )
    found = estimate_noise([reduce_recording([recording(values, DT)])]).channels
    named = ["".join(sorted(c.processes)) for c in found.values()]
    assert named == ["N", "N", "KN", "KN", "BN", "BN"]


@pytest.mark.thorough
def test_a_slow_process_has_its_correlation_time() -> None:
    values = noise(np.random.default_rng(7), 60_000, DT, 6, N=1.0, s=1.0, T=20.0)
    found = estimate_noise([reduce_recording([recording(values, DT)])]).channels
    times = [c.processes["G1"] for c in found.values() if "G1" in c.processes]
    assert len(times) >= 4
    for one in times:
        assert abs(one.time - 20.0) < 3.5 * one.time_sigma
        assert abs(one.value - 1.0) < 3.5 * one.sigma


@pytest.mark.thorough
def test_everything_scales_with_the_unit() -> None:
    values = noise(np.random.default_rng(8), 4000, DT, 6, N=1.0, K=0.2)
    one = estimate_noise([reduce_recording([recording(values, DT)])]).channels["gz"]
    other = estimate_noise(
        [reduce_recording([recording(1e-6 * values + 3.0, DT)])]
    ).channels["gz"]
    assert one.processes.keys() == other.processes.keys()
    for name, size in one.processes.items():
        assert 1e-6 * size.value == pytest.approx(other.processes[name].value, rel=1e-4)


def test_bumps_are_bridged_and_change_nothing() -> None:
    rng = np.random.default_rng(9)
    values = only(noise(rng, 20_000, 0.01, 6, N=1.0, K=0.05), 0, 4)
    calm = estimate_noise([reduce_recording([recording(values, 0.01)])])
    for at in range(2000, 20_000, 3000):
        values[at : at + 60] += 80 * rng.standard_normal((60, 6))
    bumped = estimate_noise([reduce_recording([recording(values, 0.01)])])
    assert 0.005 < bumped.bridged < 0.1 and calm.bridged < 0.005
    assert list(bumped.channels) == ["ax", "gy"]
    for name, channel in bumped.channels.items():
        before = calm.channels[name].processes["N"]
        assert abs(channel.processes["N"].value - before.value) < 6 * before.sigma
        assert channel.processes["N"].value == pytest.approx(1.0, rel=0.05)


@pytest.mark.thorough
def test_what_goes_on_all_the_time_is_no_disturbance() -> None:
    """A pump that beats every 1.5 s leaves no cell that is like it was without."""
    values = noise(np.random.default_rng(25), 6000, 0.01, 6, N=1.0)
    for at in range(20, 6000, 150):
        values[at : at + 10] *= 12
    found = estimate_noise([reduce_recording([recording(values, 0.01)])])
    assert found.seconds == pytest.approx(60, abs=0.1) and not found.bridged
    found = estimate_noise([reduce_recording([recording(values[:3050], 0.01)])])
    assert found.longest > 30


def test_what_follows_the_temperature_is_taken_out() -> None:
    rng = np.random.default_rng(10)
    t = np.arange(30_000) * DT
    warmth = 25 + 4 * np.sin(t / 300) + 0.02 * rng.standard_normal(len(t))
    values = noise(rng, len(t), DT, 6, N=1.0)
    values[:, 3:] += 0.2 * (warmth - 25)[:, None]
    values = only(values, 0, 4, 5)
    found = estimate_noise([reduce_recording([recording(values, DT, warmth)])]).channels
    assert list(found) == ["ax", "gy", "gz"]
    for name, channel in found.items():
        if name[0] == "g":
            assert channel.temperature is not None
            value, sigma = channel.temperature
            assert abs(value - 0.2) < 4 * sigma < 0.1
            assert "K" not in channel.processes and "B" not in channel.processes
        else:
            assert channel.temperature is None


@pytest.mark.thorough
def test_a_noisy_thermometer_does_not_make_a_coefficient_smaller() -> None:
    """Its own noise is in what it is divided by, where it shows nothing else."""
    rng = np.random.default_rng(26)
    t = np.arange(30_000) * DT
    course = 4 * np.sin(t / 300)
    values = noise(rng, len(t), DT, 6, N=1.0) + 0.2 * course[:, None]
    warmth = 25 + course + 6 * rng.standard_normal(len(t))
    found = estimate_noise([reduce_recording([recording(values, DT, warmth)])]).channels
    seen = [c.temperature for c in found.values() if c.temperature is not None]
    assert len(seen) == 6
    assert np.mean([value for value, _ in seen]) == pytest.approx(0.2, rel=0.05)


@pytest.mark.thorough
def test_what_scatters_more_than_its_processes_is_known_less_well() -> None:
    """Noise that swells and ebbs: neighbouring coefficients are not independent."""
    rng = np.random.default_rng(27)
    swell = 1 + 0.9 * np.sin(2 * np.pi * np.arange(16_000) * DT / 200)
    values = swell[:, None] * noise(rng, 16_000, DT, 6, N=1.0)
    found = estimate_noise(
        [reduce_recording([recording(values, DT)])]
    ).channels.values()
    # 1.86 is the mean of the fourth power over the squared one of the second
    assert 1.3 < np.mean([c.dispersion for c in found]) < 2.4


@pytest.mark.thorough
def test_noise_that_a_device_makes_quickly_is_white_to_a_second() -> None:
    """N^2 + 2 s^2 T of a Gauss-Markov process of a twentieth of a second."""
    values = noise(np.random.default_rng(28), 60_000, 0.01, 6, N=0.3, s=3.0, T=0.05)
    for channel in estimate_noise(
        [reduce_recording([recording(values, 0.01)])]
    ).channels.values():
        whole = np.sqrt(0.3**2 + 2 * 3.0**2 * 0.05)
        assert channel.processes["N"].value == pytest.approx(whole, rel=0.06)


def test_a_ramp_is_no_walk() -> None:
    values = noise(np.random.default_rng(11), 30_000, DT, 6, N=1.0, R=1e-3)
    values = only(values, 0, 5)
    found = estimate_noise([reduce_recording([recording(values, DT)])]).channels
    assert len(found) == 2
    for channel in found.values():
        ramp = channel.processes["R"]
        assert abs(ramp.value - 1e-3) < 4 * ramp.sigma
        assert "K" not in channel.processes


@pytest.mark.thorough
def test_a_filter_in_the_device_does_not_make_white_noise_smaller() -> None:
    rng = np.random.default_rng(12)
    dt = 0.005
    white = noise(rng, 60_000, dt, 6, N=1.0)
    filtered = np.apply_along_axis(
        lambda x: np.convolve(x, np.ones(8) / 8, "same"), 0, white
    )
    for channel in estimate_noise(
        [reduce_recording([recording(filtered, dt)])]
    ).channels.values():
        assert channel.processes["N"].value == pytest.approx(1.0, rel=0.08)
        assert channel.filtered_hz < 60


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("rate", "corner", "order"),
    [(100, 5, 2), pytest.param(200, 20, 2, marks=pytest.mark.thorough)],
)
def test_the_bend_of_a_filter_below_its_corner_is_not_taken_for_less_noise(
    rate: int, corner: int, order: int
) -> None:
    """Errors of white noise in stated ones: they are no larger than these, about 0."""
    taps = butter(order, corner / (rate / 2))
    pulls = []
    for seed in range(2):
        drawn = np.random.default_rng(seed).standard_normal((600 * rate, 6))
        values = lfilter(*taps, drawn * np.sqrt(rate), axis=0)
        reduced = reduce_recording([recording(values, 1 / rate)])
        for channel in estimate_noise([reduced]).channels.values():
            white = channel.processes["N"]
            pulls.append((white.value - 1) / white.sigma)
    assert np.mean(pulls) > -1 and np.sqrt(np.mean(np.square(pulls))) < 1.6


def test_a_minute_that_looks_filtered_by_chance_still_tells_its_white_noise() -> None:
    """The one of 150 recordings of 600 samples whose bins above 1 Hz look odd."""
    values = noise(np.random.default_rng(10), 600, DT, 6, N=1.0)
    made = estimate_noise([reduce_recording([recording(values, DT)])])
    white = made.channels["gy"].processes["N"]
    assert made.channels["gy"].filtered_hz < 5
    assert abs(white.value - 1) < 0.15


@pytest.mark.statistical
@pytest.mark.parametrize(
    ("name", "size"),
    [
        pytest.param("K", 0.02, marks=pytest.mark.thorough),
        ("B", 0.05),
        pytest.param("Q", 0.02, marks=pytest.mark.thorough),
    ],
)
def test_every_process_is_found_or_has_a_limit_that_holds(
    name: str, size: float
) -> None:
    """Of 18 channels with a process that is hardly seen, two limits may be too low."""
    holds = []
    for seed in range(3):
        values = noise(np.random.default_rng(seed), 3000, DT, 6, N=1.0, **{name: size})
        made = estimate_noise([reduce_recording([recording(values, DT)])])
        for channel in made.channels.values():
            assert {*channel.processes, *channel.limits} >= {"N", "B", "K", "Q"}
            if name in channel.limits:
                limit = channel.limits[name].value
                assert limit < 20 * size
                holds.append(limit > size)
    assert len(holds) > 9 and sum(holds) >= len(holds) - 2


def test_two_processes_of_the_same_time_are_one() -> None:
    levels = CosineLevels(DT, 1, 1)
    levels.add(noise(np.random.default_rng(40), 3000, DT, 1, N=1.0, s=1.0, T=2.0))
    spectrum = CosineSpectrum([levels.reduced()], 1)
    power, count = spectrum.channel_powers(
        0, spectrum.last.values[:, 0], np.ones(len(spectrum.last.bin))
    )
    powers = Powers(power, count, np.zeros(len(power), dtype=bool))
    assert fit_processes(spectrum, powers, ("N", "G"), np.log([1.0, 1.0, 2.0]))
    same = np.log([1.0, 0.5, 0.5, 2.0, 2.0])
    assert fit_processes(spectrum, powers, ("N", "G", "G"), same) is None


def test_a_filter_in_the_device_is_no_ramp_and_hides_none() -> None:
    """White noise of N behind a low-pass: a slope is known to N sqrt(12 / T^3)."""
    rng, dt, n = np.random.default_rng(17), 0.02, 60_000
    best = 1e-3 * dt**0.5 * np.sqrt(12 / (n * dt) ** 3)
    keep = np.exp(-dt / 0.1)
    drawn = 1e-3 * rng.standard_normal((n, 6))
    values = lfilter([1 - keep], [1, -keep], drawn, axis=0)
    t = np.arange(n)[:, None] * dt
    for slope in (0.0, 20 * best):
        block = recording(only(values + slope * t, 0, 2, 4), dt)
        found = estimate_noise([reduce_recording([block])]).channels.values()
        assert len(found) == 3
        seen = [c.processes["R"] for c in found if "R" in c.processes]
        assert len(seen) == (3 if slope else 0)
        for one in seen:
            assert one.sigma > 0.75 * best
            assert abs(one.value - slope) < 3.5 * best
        if seen:
            assert np.median([one.sigma for one in seen]) < 1.25 * best


def test_several_sessions_tell_more_than_one() -> None:
    rng = np.random.default_rng(13)
    parts = [
        reduce_recording([recording(only(noise(rng, 6000, DT, 6, N=1.0), 0), DT)])
        for _ in range(4)
    ]
    one, all_ = (
        estimate_noise(p).channels["ax"].processes["N"] for p in (parts[:1], parts)
    )
    assert all_.sigma == pytest.approx(one.sigma / 2, rel=0.1)


def test_a_gap_begins_another_stretch_and_a_turn_too() -> None:
    values = noise(np.random.default_rng(14), 9000, DT, 6, N=1.0)
    values[6000:, 1] += 500.0  # turned
    block = recording(only(values, 0, 1), DT)
    block.t[3000:] += 60.0
    found = reduce_recording([block[:100], block[100:5000], block[5000:]])
    assert [s.samples for s in found.stretches] == pytest.approx(
        [3000, 3000, 3000], abs=20
    )
    channels = estimate_noise([found]).channels
    assert list(channels) == ["ax", "ay"]
    for channel in channels.values():
        assert channel.processes["N"].value == pytest.approx(1.0, rel=0.08)


def test_what_is_missing_is_not_a_channel() -> None:
    values = noise(np.random.default_rng(15), 4000, DT, 6, N=1.0)
    values[:, 2] = 9.81  # stuck
    values[::7, 0] = np.nan
    values[:, 4] = np.nan
    found = estimate_noise([reduce_recording([recording(values, DT)])])
    assert list(found.channels) == ["ax", "ay", "gx", "gz"]


def test_too_short_a_recording_is_refused_with_what_to_do() -> None:
    values = noise(np.random.default_rng(16), 200, DT, 6, N=1.0)
    with pytest.raises(InputError, match=r"lasts 20 s: record 30 s at least"):
        estimate_noise([reduce_recording([recording(values, DT)])])
    with pytest.raises(InputError, match="lasts 0 s"):
        estimate_noise([reduce_recording([])])
    with pytest.raises(InputError, match="none of ax"):
        estimate_noise([reduce_recording([recording(np.zeros((900, 6)), DT)])])


def test_windows_of_half_a_minute_tell_of_means_over_half_a_minute() -> None:
    """Short stretches, coefficients of some bins in none of them."""
    rng = np.random.default_rng(24)
    parts = []
    for i in range(8):
        block = recording(only(noise(rng, 1500, 0.02, 6, N=1.0), 0, 5), 0.02)
        block.t[:] += 60.0 * i
        parts.append(block)
    found = estimate_noise([reduce_recording(parts)])
    assert found.stretches == 8 and len(found.channels) == 2
    for channel in found.channels.values():
        value, spread = channel.averaging.at(30.0)
        assert channel.averaging.seconds[-1] >= 30.0
        assert abs(value - 1 / np.sqrt(30)) < 4 * spread + 0.05
