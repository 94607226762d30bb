"""Where the spectrum stands out, in noise of known colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spectra_windows import NOISE, RATE, noise, pieces, windows_of

from fieldcal.diagnosis.signal.peaks import Peak, highest_peak
from fieldcal.diagnosis.signal.periodogram import CHANNEL_GROUPS, compute_spectra


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


def test_a_line_of_one_output_is_not_lost_among_those_of_its_triad() -> None:
    found, by_triads = 0, 0
    for seed in range(24):
        windows, *channel_groups = compute_spectra(p := windows_of(seed, 1.1e-4))
        line = highest_peak(p, [windows, *channel_groups], [])
        found += line is not None and abs(line.hz - 41.9) < 0.2
        sums = [replace(one, channel_groups=CHANNEL_GROUPS) for one in channel_groups]
        line = highest_peak(p, [windows, *sums], [])
        by_triads += line is not None and abs(line.hz - 41.9) < 0.2
    # of a power 24 times the noise, with the square root of twice that as its spread
    assert found >= 14 and found > by_triads + 3


def test_noise_in_many_windows_makes_no_line_of_one_phase() -> None:
    """Frequencies are alike over 0.25 Hz there, and no local floor tells the noise."""
    said = 0
    for seed in range(20):
        spectra = compute_spectra(p := windows_of(100 + seed, 0.0))
        said += highest_peak(p, spectra, []) is not None
    assert not said


def test_a_line_comes_before_tremor_that_is_louder_at_the_same_frequencies() -> None:
    """Tremor has another phase in each window, and in another output than the line."""
    rng = np.random.default_rng(9)
    p = windows_of(4, 1.6e-4)
    for t, six in zip(p.times, p.samples, strict=True):
        for hz in (12.0, 33.0, 41.5):
            phase = rng.uniform(0, 2 * np.pi)
            six[:, 3] += 1e-3 * rng.rayleigh() * np.sin(2 * np.pi * hz * t + phase)
    windows, *one_phase = spectra = compute_spectra(p)
    line = highest_peak(p, spectra, [])
    assert line is not None and line.hz == pytest.approx(41.9, abs=0.01)
    assert line.channels == (5,)
    loudest = highest_peak(p, [windows], [])
    assert loudest is not None and loudest.channels == (3,)
    # with one phase there is nothing that chance does not make of such tremor
    assert highest_peak(p, spectra, [line]) is None


def test_a_line_keeps_its_phase_in_windows_of_different_lengths() -> None:
    """Long windows have most of a line's power, which is no tremor in them."""
    rng = np.random.default_rng(12)
    lengths, starts = (3600, 180, 900, 240, 2000), (0.0, 25.0, 40.0, 61.0, 80.0)
    times = [s + np.arange(n) / RATE for n, s in zip(lengths, starts, strict=True)]
    samples = [noise(rng, n) for n in lengths]
    for t, six in zip(times, samples, strict=True):
        six[:, 3] += 1.5e-4 * np.sin(2 * np.pi * 12.06 * t)
    p = pieces(times, samples)
    line = highest_peak(p, compute_spectra(p), [])
    assert line is not None and line.hz == pytest.approx(12.06, abs=0.01)
