"""Spectra, against sums written out."""

from __future__ import annotations

import numpy as np
import pytest
from spectra_windows import RATE, late, noise, pieces

from fieldcal.diagnosis.signal.peaks import highest_peak
from fieldcal.diagnosis.signal.periodogram import compute_spectra, window_spectrum


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


@pytest.mark.parametrize("n", [32_768, 49_152, 65_535])
def test_of_a_window_of_any_length_a_line_shows_wherever_it_is(n: int) -> None:
    """Half a step off the grid it loses what a taper may, 1.4 dB, and no more."""
    t = np.arange(n) / RATE
    found = []
    for off in (0.0, 0.5):
        hz = (5000 + off) * RATE / 32_768
        wave = 1e-3 * np.sin(2 * np.pi * hz * t)[:, None] * np.ones(6)
        found.append(window_spectrum(pieces([t], [wave])).power.max())
    assert 0.97 * 10**-0.14 < found[1] / found[0] < 1.01
