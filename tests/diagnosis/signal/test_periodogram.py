"""Where the spectrum stands out, against sums written out and noise of known colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from fieldcal.core.samples import Array
from fieldcal.diagnosis.signal.periodogram import (
    TRIADS,
    Peak,
    compute_spectra,
    highest_peak,
)
from fieldcal.diagnosis.signal.pieces import WindowSamples
from fieldcal.physics.experience import Experience

RATE = 200.0
NOISE = np.full(6, 1e-3)


def pieces(times: Sequence[Array], samples: Sequence[Array]) -> WindowSamples:
    """Windows of one device that was never turned."""
    still = np.zeros(len(times))
    x = Experience.at_rest(still, still, 9.81)
    return WindowSamples(x, tuple(samples), tuple(times), NOISE, RATE)


def late(rng: np.random.Generator, n: int) -> Array:
    """Times of which every thirtieth or so is a fifth of a period late for good."""
    steps = np.where(rng.random(n) < 1 / 30, 1.2, 1.0) / RATE
    return np.cumsum(steps)


def noise(rng: np.random.Generator, n: int) -> Array:
    """White noise in all outputs."""
    return NOISE * rng.standard_normal((n, 6))


def test_samples_out_of_step_are_summed_at_their_own_times() -> None:
    rng = np.random.default_rng(1)
    n = 1500
    t, six = late(rng, n), noise(rng, n)
    spectrum = compute_spectra(pieces([t], [six]))[0]
    taper = np.hanning(n)
    wave = np.exp(-2j * np.pi * spectrum.hz[:, None] * t)
    slow = np.abs(wave @ (six * taper[:, None])).T ** 2 / (taper @ taper)
    low = spectrum.hz < 0.4 * RATE
    share = spectrum.power[:, low].sum(axis=1) / slow[:, low].sum(axis=1)
    assert share == pytest.approx(1, abs=0.05)
    alike = [np.corrcoef(a, b)[0, 1] for a, b in zip(spectrum.power, slow, strict=True)]
    assert min(alike) > 0.95


def test_stamps_of_arrival_in_bursts_are_no_times_of_samples() -> None:
    """Packets of eight samples: a line stands out as if they came evenly."""
    rng = np.random.default_rng(8)
    n, hz = 4000, 31.7
    even = np.arange(n) / RATE
    stamps = np.floor(even * RATE / 8) * 8 / RATE + 1e-4 * (np.arange(n) % 8)
    six = noise(rng, n)
    six[:, 2] += 3e-4 * np.sin(2 * np.pi * hz * even)
    line = highest_peak(p := pieces([stamps], [six]), compute_spectra(p), [])
    assert line is not None
    assert line.hz == pytest.approx(hz, abs=0.03)


def test_evenly_sampled_windows_keep_their_whole_power_with_one_phase() -> None:
    """A window may begin between the samples of another one, half a period off."""
    hz, size = 67.3, 1.0
    times = [np.arange(600) / RATE + s for s in (0.0, 7.0025, 15.0013)]
    wave = [size * np.cos(2 * np.pi * hz * t)[:, None] * np.ones(6) for t in times]
    spectrum = compute_spectra(pieces(times, wave))[1]
    taper = np.hanning(600).sum()
    assert spectrum.power[0].max() == pytest.approx((3 * taper / 2) ** 2, rel=0.1)


def test_the_noise_beside_a_line_is_that_of_its_frequency() -> None:
    """Filtered noise: a moving mean of two samples leaves cos^2(pi hz / rate) of it."""
    rng = np.random.default_rng(3)
    found = []
    for _ in range(6):
        t = np.arange(6000) / RATE
        white = noise(rng, 6001)
        six = (white[1:] + white[:-1]) / 2
        hz = 80.0
        six[:, 4] += 6e-5 * np.sin(2 * np.pi * hz * t)
        peak = highest_peak(p := pieces([t], [six]), compute_spectra(p), [])
        assert peak is not None
        assert peak.hz == pytest.approx(hz, abs=0.02)
        found.append(peak.noise / NOISE)
    expected = np.cos(np.pi * 80 / RATE)
    assert np.mean(found, axis=0) == pytest.approx(np.full(6, expected), rel=0.1)


def test_what_is_no_line_is_passed_in_one_look_however_broad() -> None:
    """An engine whose speed wanders, and a weak line elsewhere."""
    rng = np.random.default_rng(4)
    n = 12_000
    t, six = np.arange(n) / RATE, noise(rng, n)
    speed = 45.0 + 0.15 * np.sin(2 * np.pi * 0.07 * t)
    six[:, 0] += 3e-3 * np.sin(2 * np.pi * np.cumsum(speed) / RATE)
    six[:, 5] += 1.4e-4 * np.sin(2 * np.pi * 20.25 * t)
    engine = highest_peak(p := pieces([t], [six]), compute_spectra(p), [])
    assert engine is not None
    assert engine.low < speed.min() + 0.1
    assert engine.high > speed.max() - 0.1
    line = highest_peak(p, compute_spectra(p), [engine])
    assert line is not None
    assert line.hz == pytest.approx(20.25, abs=0.02)


def test_white_noise_has_no_line() -> None:
    """At the chance of one in a thousand, 60 of them."""
    rng = np.random.default_rng(5)
    said = 0
    for _ in range(60):
        t = [np.arange(1000) / RATE + s for s in (0.0, 9.0)]
        p = pieces(t, [noise(rng, 1000) for _ in t])
        said += highest_peak(p, compute_spectra(p), []) is not None
    assert said <= 1


def test_near_what_is_taken_nothing_is_left() -> None:
    rng = np.random.default_rng(7)
    t = np.arange(4000) / RATE
    six = noise(rng, 4000)
    six[:, 1] += 1e-3 * np.sin(2 * np.pi * 31.0 * t)
    p = pieces([t], [six])
    first = highest_peak(p, compute_spectra(p), [])
    assert first is not None
    line = Peak(first.hz, first.hz, first.hz, first.noise)
    assert highest_peak(p, compute_spectra(p), [line]) is None


def windows_of(seed: int, size: float) -> WindowSamples:
    """Fifteen windows with a line of 41.9 Hz in one output, too weak for one window."""
    rng = np.random.default_rng(seed)
    starts = 8.0 * np.arange(15) + np.round(rng.uniform(0, 2, 15) * RATE) / RATE
    times = [np.arange(800) / RATE + start for start in starts]
    samples = [noise(rng, len(t)) for t in times]
    for t, six in zip(times, samples, strict=True):
        six[:, 5] += size * np.sin(2 * np.pi * 41.9 * t)
    return pieces(times, samples)


def test_a_line_of_one_output_is_not_lost_among_those_of_its_triad() -> None:
    found, by_triads = 0, 0
    for seed in range(24):
        windows, *channel_groups = compute_spectra(p := windows_of(seed, 1.1e-4))
        line = highest_peak(p, [windows, *channel_groups], [])
        found += line is not None and abs(line.hz - 41.9) < 0.2
        sums = [replace(one, channel_groups=TRIADS) for one in channel_groups]
        line = highest_peak(p, [windows, *sums], [])
        by_triads += line is not None and abs(line.hz - 41.9) < 0.2
    # of a power 24 times the noise, with the square root of twice that as its spread
    assert found >= 14 and found > by_triads + 3


def test_noise_in_many_windows_makes_no_line_of_one_phase() -> None:
    """Frequencies are alike over 0.25 Hz there, and no local floor tells the noise."""
    said = 0
    for seed in range(60):
        spectra = compute_spectra(p := windows_of(100 + seed, 0.0))
        said += highest_peak(p, spectra, []) is not None
    assert said <= 1
