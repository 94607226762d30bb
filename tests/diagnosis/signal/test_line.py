"""What a line foretells of samples that it was not fitted to."""

import numpy as np
import pytest

from fieldcal.core.samples import Block
from fieldcal.diagnosis.signal.line import (
    LineRemainder,
    line_remainder,
    measured_amplitudes,
    tune_line,
)
from fieldcal.diagnosis.signal.moments import moments_of
from fieldcal.diagnosis.signal.pieces import WindowSamples, samples_of_windows
from fieldcal.effects.hum import Hum
from fieldcal.effects.sway import Sway
from fieldcal.model import resolutions
from fieldcal.model.rows.reduce import reduce_to_rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.physics.experience import Experience
from fieldcal.session.description_file import parse_description

RATE, SIGMA, HZ, SIZE = 100.0, 5e-3, 7.03, 6e-4
SEEDS = range(12)


def recorded(
    seed: int, windows: int, samples: int, phase: float = 0.0
) -> WindowSamples:
    """A line on a_y in white noise, its phase perhaps another in each window."""
    rng = np.random.default_rng(seed)
    six, times = [], []
    for i in range(windows):
        t = 3.0 + i * (samples / RATE + 7.3) + np.arange(samples) / RATE
        noise = rng.normal(0, SIGMA, (samples, 6))
        noise[:, 1] += SIZE * np.cos(2 * np.pi * HZ * t + 0.4 + phase * i**2)
        six.append(noise - noise.mean(axis=0))
        times.append(t)
    x = Experience.at_rest(np.zeros(windows), np.zeros(windows), 9.81)
    return WindowSamples(x, tuple(six), tuple(times), np.full(6, SIGMA), RATE)


def left(pieces: WindowSamples) -> LineRemainder:
    """What is left of the line, whatever it is found to be."""
    tone = tune_line(pieces, Hum(), moments_of(pieces, HZ + 2e-4))
    assert tone.channels == ("ay",)
    return line_remainder(pieces, tone)


@pytest.mark.parametrize(
    ("windows", "samples", "groups"), [(9, 2000, 9), (1, 18000, 5)]
)
def test_a_line_is_foretold_as_well_as_noise_lets_it(
    windows: int, samples: int, groups: int
) -> None:
    """Mean squares are those of the line, and of noise on top as theory has it."""
    found = [left(recorded(seed, windows, samples)) for seed in SEEDS]
    before = np.mean([r.before[1] for r in found])
    ahead = np.mean([r.held_out[1] for r in found])
    after = np.mean([r.after[1] for r in found])
    noise = 2 * SIGMA**2 * groups / (windows * samples)  # of |A|^2 / 2 in one group
    error = noise / np.sqrt(groups * len(SEEDS))
    assert before == pytest.approx(SIZE**2 / 2 + noise, abs=5 * SIZE * np.sqrt(error))
    # amplitude, phase and frequency come out of the groups: three of 2 G numbers
    assert after == pytest.approx(noise * (1 - 1.5 / groups), abs=4 * error)
    # the frequency is known the worse at either end, so by more than 1.5 / G
    assert noise - 4 * error < ahead < 2.0 * noise
    assert all(r.gain([1]) > 0.25 for r in found)


def test_what_has_another_phase_each_time_is_not_foretold() -> None:
    """An amplitude that all windows share is no line if the phase wanders."""
    found = [left(recorded(seed, 9, 4000, phase=1.1)) for seed in SEEDS]
    assert np.mean([r.gain([1]) for r in found]) < 0.1


def test_channels_without_the_line_stay_as_they_are() -> None:
    """What is not in a channel is neither taken out of it nor foretold in it."""
    found = left(recorded(1, 9, 2000))
    others = [0, 2, 3, 4, 5]
    assert (found.before[others] == found.held_out[others]).all()
    assert (found.before[others] == found.after[others]).all()


def test_sway_is_foretold_in_positions_not_seen() -> None:
    """The base's sway in one position follows from that in the others."""
    rng = np.random.default_rng(5)
    sway, alpha = Sway(), np.deg2rad(np.arange(0.0, 50.0, 5.0))
    x = Experience.at_rest(alpha, 0.1 * alpha, 9.81)
    response = sway.response(x, 0.83)
    causes = np.array([0.02, 0.01j])  # deg
    six, times = [], []
    for i, seen in enumerate(response @ causes):
        t = 40.0 * i + np.arange(3000) / RATE
        wave = np.exp(2j * np.pi * 0.83 * t)
        six.append(np.real(wave[:, None] * seen) + rng.normal(0, SIGMA, (3000, 6)))
        times.append(t)
    pieces = WindowSamples(x, tuple(six), tuple(times), np.full(6, SIGMA), RATE)
    tone = tune_line(pieces, sway, moments_of(pieces, 0.83))
    found = line_remainder(pieces, tone)
    assert tone.clear_channels
    assert found.gain(tone.clear_channels) > 0.7


def test_a_line_is_tuned_in_windows_longer_than_a_periodogram() -> None:
    """What a periodogram tells of its frequency is far from what the window tells."""
    pieces = recorded(3, 1, 12 * resolutions.PERIODOGRAM_SAMPLES)
    off = 0.3 * RATE / resolutions.PERIODOGRAM_SAMPLES
    tone = tune_line(pieces, Hum(), moments_of(pieces, HZ + off))
    assert tone.channels == ("ay",)
    assert abs(tone.hz - HZ) < 4 * tone.sigmas["hz"]


def test_a_slow_line_keeps_what_the_slopes_of_windows_took() -> None:
    """Its amplitude and frequency are as certain as they say; six periods a window."""
    t = [15.0 * i + np.arange(1000) / RATE for i in range(10)]
    x = Experience.at_rest(np.zeros(10), np.zeros(10), 9.81)
    every = tuple(np.ones((1000, 6), dtype=bool) for _ in t)
    off = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        samples = []
        for own in t:
            six = rng.normal(0, SIGMA, (1000, 6))
            six[:, 1] += 0.01 * np.cos(2 * np.pi * 0.6 * own + 0.1)
            line = np.polynomial.polynomial.polyfit(own - own.mean(), six, 1)
            samples.append(six - line[0] - np.outer(own - own.mean(), line[1]))
        pieces = WindowSamples(
            x, tuple(samples), tuple(t), np.full(6, SIGMA), RATE, every
        )
        tone = tune_line(pieces, Hum(), moments_of(pieces, 0.601))
        off.append([(tone.values["ay"] - 0.01) / tone.sigmas["ay"],
                    (tone.hz - 0.6) / tone.sigmas["hz"]])  # fmt: skip
    mean, rms = np.mean(off, axis=0), np.sqrt(np.mean(np.square(off), axis=0))
    assert (np.abs(mean) < 0.7).all(), "3 of the means' errors"
    assert (rms > 0.5).all() and (rms < 1.5).all()


def test_what_never_changes_has_no_line_of_rounding() -> None:
    """A mean that is taken out of a constant leaves 1e-17, a wave of its own."""
    t = np.arange(0.0, 60.0, 0.01)
    acc = np.where((t < 30.0)[:, None], [0.20593965, -10.03220295, 0.1176798],
                   [9.7323951, 0.31415927, -0.2212121])  # fmt: skip
    about = parse_description({"format": 1, "position": [
        {"alpha_deg": 0.0, "beta_deg": 0.0, "start_s": 1.0, "end_s": 28.7},
        {"alpha_deg": 90.0, "beta_deg": 0.0, "start_s": 31.0, "end_s": 58.3},
    ]})  # fmt: skip
    block = Block.of(t, acc, np.full_like(acc, 0.004))
    usable = np.ones((len(t), 6), dtype=bool)
    source = RowSource(block, about, usable, np.zeros(2), Thermometer.of(block))
    pieces = samples_of_windows(source, reduce_to_rows(source))
    assert len(pieces.samples) == 2
    assert not any(samples.any() for samples in pieces.samples)


def test_amplitudes_within_the_noise_are_measured() -> None:
    """The power is that of wave and noise; sigma is that of each part of the noise."""
    powers, sigmas = [], []
    for seed in range(40):
        values, told = measured_amplitudes(recorded(seed, 6, 800), Hum(), HZ)
        assert values.keys() == told.keys() == {"ax", "ay", "az", "gx", "gy", "gz"}
        powers.append([values["ay"] ** 2, values["az"] ** 2])
        sigmas.append(told["ay"])
    noise = 4 * SIGMA**2 / (6 * 800)
    assert np.allclose(2 * np.square(sigmas), noise, rtol=0.01)
    # |A|^2 has a mean of a^2 + s^2 and a variance of s^4 + 2 a^2 s^2
    for power, size in zip(np.mean(powers, axis=0), (SIZE, 0.0), strict=True):
        spread = np.sqrt((noise**2 + 2 * size**2 * noise) / 40)
        assert abs(power - size**2 - noise) < 4 * spread
