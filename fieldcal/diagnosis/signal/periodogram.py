"""Power spectra of the outputs at rest, and the level of their noise.

Hann-windowed periodograms of W windows are summed; white noise makes the sum at one
frequency a multiple of Gamma(W), and the median of neighbours gives its size.

With one phase throughout, the Fourier sums X_w of the windows are added before they are
squared. Noise at neighbouring frequencies is alike there, over the bandwidth of a
window, so its level comes from the windows side by side. Tremor has another phase each
time and is noise as well, of the level

    (Q sum |X_w|^2 / q_w - |sum X_w|^2) / (W - 1),    Q = sum q_w                  (1)

with q_w the sum of the squares of the taper of a window, which is proportional to its
length. A line with one phase leaves that as it is.
Source: D. Percival, A. Walden, Spectral Analysis for Physical Applications, chapter 10.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.diagnosis.signal.noise_level import noise_level
from fieldcal.diagnosis.signal.pieces import Complex, WindowSamples
from fieldcal.model import detections, resolutions, thresholds, tolerances

CHANNEL_GROUPS = ((0, 1, 2), (3, 4, 5), (0, 1, 2, 3, 4, 5))
"""Channels that are searched together for a line of one phase."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Power of all channels.

    Attributes
    ----------
    power : (6, m)
    count : periodograms summed in it
    hz : (m,)
    channel_groups : groups of channels whose summed power is searched
    known_level : (6, m) mean power of noise, if it is not estimated from `power`

    """

    power: Array
    count: int
    hz: Array
    channel_groups: tuple[tuple[int, ...], ...]
    known_level: Array | None = None

    @property
    def channels(self) -> list[int]:
        """Channels that are searched, ascending."""
        return sorted({c for group in self.channel_groups for c in group})

    def power_over_noise(self, channel: int, band: Mask) -> Array:
        """Power in a band over that of noise; Gamma(count) if there is noise only."""
        power = self.power[channel, band]
        known = None if self.known_level is None else self.known_level[channel, band]
        out: Array = power / noise_level(power, self.count, known) * self.count
        return out


def noise_near(spectrum: Spectrum, hz: float, white: Array) -> Array:
    """Deviation of white noise with the spectrum's power near a frequency, (6,).

    For channels that the spectrum does not contain it is `white`.
    """
    noise, at = white.copy(), int(np.argmin(np.abs(spectrum.hz - hz)))
    for c in spectrum.channels:
        level = noise_level(spectrum.power[c], spectrum.count)[at]
        noise[c] = np.sqrt(level / spectrum.count)
    return noise


def compute_spectra(pieces: WindowSamples) -> list[Spectrum]:
    """Spectra that are searched for lines.

    The first is summed over windows, channel by channel. The others have one phase
    throughout: channels and triads in device axes and, where the angles are known,
    triads in base axes; they are left out where times are those of arrival, which keep
    no phase. Windows are tapered, since a decay at the start of each is no line.
    """
    windows = window_spectrum(pieces)
    out = [windows]
    lasts = pieces.times[-1][-1] - pieces.times[0][0]
    long = (
        lasts * pieces.rate > detections.MAX_COHERENT_PERIODS
        or sum(map(len, pieces.samples)) > tolerances.MAX_COHERENT_SAMPLES
    )
    if long or any(_in_bursts(t, pieces.rate) for t in pieces.times):
        return out
    frames = [np.broadcast_to(np.eye(3), (len(pieces.samples), 3, 3))]
    if pieces.x.oriented.all():
        frames.append(np.swapaxes(pieces.x.to_device, 1, 2))
    measured = set(windows.channels)
    triads = [channels for channels in CHANNEL_GROUPS if measured.issuperset(channels)]
    # electronics may disturb one output alone, motion of the base disturbs a triad
    groups = [(*windows.channel_groups, *triads), tuple(triads)]
    variance = _neighbour_variance(windows, pieces)
    sure = 1 + thresholds.WITHIN_NOISE / np.sqrt(max(len(pieces.samples) - 1, 1))
    for frame, channel_groups in zip(frames, groups, strict=False):
        power, tremor, hz = _coherent_power(pieces, frame)
        noise = np.array([np.interp(hz, windows.hz, row) for row in variance])
        level = _level_with_one_phase(pieces, frame, noise)
        level = np.where(tremor > sure * level, tremor, level)
        out.append(Spectrum(power, 1, hz, channel_groups, level))
    return out


def window_spectrum(pieces: WindowSamples) -> Spectrum:
    """Power summed over windows, channel by channel."""
    length = min(resolutions.PERIODOGRAM_SAMPLES, max(map(len, pieces.samples)))
    n = 1 << (length - 1).bit_length()
    total, count = np.zeros((6, n // 2 + 1)), 0
    for samples, t in zip(pieces.samples, pieces.times, strict=True):
        parts = -(-len(samples) // resolutions.PERIODOGRAM_SAMPLES)
        split = (np.array_split(a, parts) for a in (samples, t))
        for part, times in zip(*split, strict=True):
            taper = np.hanning(len(part))
            spectrum = _fourier_sums(part.T * taper, times, pieces.rate, n)
            total += _squared_magnitude(spectrum) / (taper @ taper)
            count += 1
    used = np.flatnonzero(total.any(axis=1)).tolist()
    hz = np.fft.rfftfreq(n, 1 / pieces.rate)
    return Spectrum(total, count, hz, tuple((c,) for c in used))


def _neighbour_variance(windows: Spectrum, pieces: WindowSamples) -> Array:
    """Variance of a sample of noise by the neighbours of each frequency, (6, m).

    They lie beyond the reach of a line: that of the taper of the shortest window.
    """
    count, size = windows.count, windows.power.shape[1]
    cycle = pieces.rate / pieces.shortest_samples(resolutions.PERIODOGRAM_SAMPLES)
    close = max(
        detections.NEAREST_NEIGHBOUR,
        math.ceil(detections.LINE_DISTANCE_CYCLES * cycle / windows.hz[1]),
    )
    reach = close + max(
        detections.FURTHEST_NEIGHBOUR - detections.NEAREST_NEIGHBOUR,
        close,
        -(-resolutions.LEVEL_PERIODOGRAMS // (2 * count)),
    )
    kernel = np.ones(2 * reach + 1)
    kernel[reach - close : reach + close + 1] = 0.0
    neighbours = np.convolve(np.ones(size), kernel)[reach:-reach]
    total = [np.convolve(row, kernel)[reach:-reach] for row in windows.power]
    out: Array = np.array(total) / np.maximum(neighbours, 1.0) / count
    return out


def _level_with_one_phase(
    pieces: WindowSamples, frame: Array, variance: Array
) -> Array:
    """Mean power with one phase of noise of a variance (6, m) per sample.

    `frame` (w, 3, 3) rotates each window.
    """
    shares = np.einsum("w,wij->ij", _taper_squares(pieces), frame**2)
    return np.vstack([shares @ variance[:3], shares @ variance[3:]])


def _taper_squares(pieces: WindowSamples) -> Array:
    """q_w of (1), the sum of the squares of each window's taper, (w,)."""
    return np.array([(np.hanning(len(s)) ** 2).sum() for s in pieces.samples])


def _coherent_power(pieces: WindowSamples, frame: Array) -> tuple[Array, Array, Array]:
    """Power with one phase throughout, that of what has none, (1), and frequencies.

    (6, m), (6, m) and (m,) Hz. `frame` (w, 3, 3) rotates each window into the axes in
    which the phase is kept.
    """
    turned, squares = [], _taper_squares(pieces)
    for samples, to_frame in zip(pieces.samples, frame, strict=True):
        tapered = (np.hanning(len(samples))[:, None] * samples).T
        turned.append(np.vstack([to_frame @ tapered[:3], to_frame @ tapered[3:]]))
    t, rate, count = np.concatenate(pieces.times), pieces.rate, len(turned)
    n = _next_fast_length(2 * round((t[-1] - t[0]) * rate) + 2)
    power = _squared_magnitude(_fourier_sums(np.hstack(turned), t, rate, n))
    hz = np.fft.rfftfreq(n, 1 / rate)
    if count == 1:
        return power, np.zeros_like(power), hz
    short = 2 * _next_fast_length(max(map(len, pieces.times)))
    each = np.zeros((6, short // 2 + 1))
    for values, at, square in zip(turned, pieces.times, squares, strict=True):
        each += _squared_magnitude(_fourier_sums(values, at, rate, short)) / square
    coarse = np.fft.rfftfreq(short, 1 / rate)
    total = np.array([np.interp(hz, coarse, row) for row in each])
    return power, (squares.sum() * total - power) / (count - 1), hz  # (1)


def _next_fast_length(n: int) -> int:
    """The next length with factors 2, 3 and 5 only, for a fast transform.

    `scipy.fft.next_fast_len` knows more lengths, but importing it takes 0.2 s.

    >>> _next_fast_length(1000), _next_fast_length(1001), _next_fast_length(4097)
    (1000, 1024, 4320)
    """
    odd = [int(3**i * 5**j) for i in range(5) for j in range(4)]
    return min(m << (-(-n // m) - 1).bit_length() for m in odd)


def _fourier_sums(values: Array, t: Array, rate: float, n: int) -> Complex:
    """Fourier sums of samples (c, m) at the multiples of rate / n up to half the rate.

    They are taken at the times t (m,) of the samples, which in a log may be uneven. If
    the times are those of arrival, samples count as evenly spaced.
    """
    at = (t - t[0]) * rate
    even = np.ptp(at - np.arange(len(at))) < 0.5 / resolutions.GRID_PER_SAMPLE
    if len(at) <= n and (even or _in_bursts(t, rate)):
        return np.fft.rfft(values, n)
    place = np.round(at * resolutions.GRID_PER_SAMPLE).astype(np.intp) % (
        n * resolutions.GRID_PER_SAMPLE
    )
    grid = [np.bincount(place, row, n * resolutions.GRID_PER_SAMPLE) for row in values]
    whole: Complex = np.fft.rfft(np.array(grid))
    return whole[:, : n // 2 + 1]


def _in_bursts(t: Array, rate: float) -> bool:
    """Whether times are those of arrival: many steps are shorter than a device's."""
    return bool(
        np.mean(np.diff(t) * rate < detections.SHORT_STEP) > detections.SHORT_STEP_SHARE
    )


def _squared_magnitude(spectrum: Complex) -> Array:
    return spectrum.real**2 + spectrum.imag**2
