"""Significant lines in the spectrum of the outputs at rest.

Hann-windowed periodograms of the windows are summed and compared with the median of
neighbouring frequencies. With W windows and white noise the sum at one frequency has
the distribution Gamma(W), which gives the probability of the highest value of all
frequencies and channels.
Source: D. Percival, A. Walden, Spectral Analysis for Physical Applications, chapter 10.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.diagnosis.signal.pieces import Complex, WindowSamples
from fieldcal.model import thresholds
from fieldcal.physics.recording import medians

LONGEST = 32_768
"""Samples of one periodogram."""

CYCLES = 2.5
"""Fewest cycles in a window that make a line."""

BESIDE = 40
"""Neighbours that give the floor, to either side."""

CLOSE, FAR = 5, 12
"""Nearest and furthest neighbours beyond the taper's reach; they give the slope."""

SURE = 200
"""Periodograms whose mean tells the level of noise, to 7 %."""

SIGMAS = 3.0
"""Standard deviations of what windows differ by, from which it is more than noise."""

STEEP = 4.0
"""Multiple of the floor above which these neighbours replace it."""

SLOPE = 0.3
"""Part of the power at a frequency that is below it on a slope; beside a line, less."""

BURST, BURSTS = 0.5, 0.01
"""Time step, in sampling periods, below which a step cannot be the device's own, and
part of the steps that are so short where times are those of arrival."""

HUMP = 2.0
"""Times the floor down to which the power about a peak belongs to it."""

FINER = 4
"""Grid points per sampling period for samples at uneven times: an error of an eighth of
a period costs 3 % of the power at most below 0.4 of the rate, one of a half a third."""

NEAR = 2.0
"""Distance between two lines, in cycles of the shortest window."""

LOOKS = 16
"""Spectra looked at."""

TRIADS = ((0, 1, 2), (3, 4, 5), (0, 1, 2, 3, 4, 5))
"""Channels that are searched together for a line of one phase."""

COHERENT = 1 << 18
"""Most samples of a recording that is searched for lines of one phase throughout."""


GRID = 1 << 20
"""Longest such recording, in sampling periods: over longer pauses no clock keeps the
phase of a line."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Power of all channels.

    Attributes
    ----------
    power : (6, m)
    count : periodograms summed in it
    hz : (m,)
    channel_groups : channels in whose sums a line may stand out
    level : (6, m) mean power of noise, where it is known otherwise

    """

    power: Array
    count: int
    hz: Array
    channel_groups: tuple[tuple[int, ...], ...]
    level: Array | None = None


@dataclass(frozen=True, slots=True)
class Peak:
    """A peak of the power spectrum, Hz.

    Attributes
    ----------
    hz : where it is highest_peak
    low, high : between which it is above the floor; a line's own are its frequency
    noise : (6,) standard deviation of a sample of white noise as strong as what is
        beside it: filters and bearings make noise that is not white
    channels : in which, channel_groups

    """

    hz: float
    low: float
    high: float
    noise: Array
    channels: tuple[int, ...] = ()


def highest_peak(
    pieces: WindowSamples, spectra: Sequence[Spectrum], taken: Sequence[Peak]
) -> Peak | None:
    """The most significant peak, None if there is none.

    Spectra of one phase throughout come first: tremor is louder, but is no line. Peaks
    close to those in `taken` are ignored.
    """
    shortest = min(LONGEST, min(map(len, pieces.samples))) / pieces.rate
    low, reach = max(0.05, CYCLES / shortest), NEAR / shortest
    one_phase = [s for s in spectra if s.count == 1]
    peak = _significant(one_phase, low, reach, taken)
    windows, passed = [s for s in spectra if s.count > 1], list[Peak]()
    while peak is None:
        peak = _significant(windows, low, reach, taken, passed)
        if peak is None:
            return None
        if one_phase and not _may_last(one_phase, peak, reach):
            passed.append(peak)
            peak = None
    # a line in short windows reaches its neighbours
    near = noise_near(spectra[0], peak.hz, pieces.noise)
    return replace(peak, noise=np.minimum(near, pieces.noise))


def _significant(
    spectra: Sequence[Spectrum],
    low: float,
    reach: float,
    taken: Sequence[Peak],
    passed: Sequence[Peak] = (),
) -> Peak | None:
    """The most significant peak of some spectra, None if chance makes as high ones."""
    found = [_highest_in_spectrum(s, low, reach, taken, passed) for s in spectra]
    odds, peak = min(filter(None, found), key=itemgetter(0), default=(0.0, None))
    return peak if odds < np.log(thresholds.LINE_BY_CHANCE) else None


def _may_last(one_phase: Sequence[Spectrum], peak: Peak, reach: float) -> bool:
    """Whether a peak of the windows may be a line: near it one phase lasts.

    In the channel in which it stands out, as far as that can be told.
    """
    low, high = peak.hz - reach, peak.hz + reach
    for spectrum in one_phase:
        near = (spectrum.hz >= low) & (spectrum.hz <= high)
        stands = [_stands(spectrum, c, near) for c in peak.channels]
        odds = _log_gamma_tail(float(np.max(stands)), 1) + np.log(near.sum())
        if odds < np.log(thresholds.LINE_BY_CHANCE):
            return True
    return False


def _stands(spectrum: Spectrum, channel: int, band: NDArray[np.bool_]) -> Array:
    """Power in that of the noise, by frequency, summed over the periodograms."""
    power = spectrum.power[channel, band]
    known = None if spectrum.level is None else spectrum.level[channel, band]
    level = _noise_level(power, spectrum.count, known)
    out: Array = power / level * spectrum.count
    return out


def _highest_in_spectrum(
    spectrum: Spectrum,
    low: float,
    reach: float,
    taken: Sequence[Peak],
    passed: Sequence[Peak],
) -> tuple[float, Peak] | None:
    """The highest peak of a spectrum, with the ln probability of one by chance.

    Near those that were taken already there is none, nor, in the channels of those that
    were passed over, near these.
    """
    band, count = spectrum.hz >= low, spectrum.count
    hz = spectrum.hz[band]
    used = sorted({c for some in spectrum.channel_groups for c in some})
    stands = {c: _stands(spectrum, c, band) for c in used}
    best: tuple[float, Peak] | None = None
    for some in spectrum.channel_groups:
        there = [*taken, *(p for p in passed if set(p.channels) & set(some))]
        free = _away_from(hz, there, reach)
        if free.sum() < 4 * BESIDE:
            continue
        total = np.sum([stands[c] for c in some], axis=0)
        at = int(np.argmax(np.where(free, total, 0.0)))
        odds = _log_gamma_tail(float(total[at]), count * len(some))
        odds += np.log(LOOKS * len(total))
        if best is None or odds < best[0]:
            peak = _peak_at(hz, total / (count * len(some)), at)
            best = odds, replace(peak, channels=some)
    return best


def _away_from(hz: Array, peaks: Sequence[Peak], reach: float) -> NDArray[np.bool_]:
    """Frequencies that are close to none of some peaks, (m,)."""
    free = np.ones(len(hz), dtype=bool)
    for peak in peaks:
        free &= (hz < peak.low - reach) | (hz > peak.high + reach)
    return free


def _noise_level(power: Array, count: int, known: Array | None = None) -> Array:
    """Mean power of noise at each frequency, of the sum of some periodograms (m,)."""
    if known is None:
        # median of Gamma(W) over its mean, by Wilson and Hilferty
        known = _median_floor(power) / (1 - 1 / (9 * count)) ** 3
    return _floor_on_slope(power, known)


def noise_near(spectrum: Spectrum, hz: float, white: Array) -> Array:
    """Deviation of white noise with the spectrum's power near a frequency, (6,).

    For channels that the spectrum does not contain it is `white`.
    """
    noise, at = white.copy(), int(np.argmin(np.abs(spectrum.hz - hz)))
    for c in sorted({c for some in spectrum.channel_groups for c in some}):
        level = _noise_level(spectrum.power[c], spectrum.count)[at]
        noise[c] = np.sqrt(level / spectrum.count)
    return noise


def _peak_at(hz: Array, power: Array, at: int) -> Peak:
    """The peak at a frequency; power (m,) in units of the floor.

    It reaches as far as the smoothed power stays above the floor: a machine whose speed
    varies makes a broad peak, which is no line.
    """
    kernel = np.ones(2 * FAR + 1) / (2 * FAR + 1)
    low = np.flatnonzero(np.convolve(power, kernel, "same") < HUMP)
    below, above = low[low < at], low[low > at]
    first = int(below[-1]) if len(below) else 0
    last = int(above[0]) if len(above) else len(hz) - 1
    return Peak(float(hz[at]), float(hz[first]), float(hz[last]), np.zeros(6))


def compute_spectra(pieces: WindowSamples) -> list[Spectrum]:
    """Spectra that are searched for lines.

    Channel by channel window by window; and with one phase throughout, channels and
    triads in the device's axes and, where the angles are known, triads in the base's.
    Windows are
    tapered: what settles at the start of each is no line, though it comes as often.
    Stamps of arrival keep no phase.
    """
    power, count, hz = _power_by_window(pieces)
    used = np.flatnonzero(power.any(axis=1)).tolist()
    windows = Spectrum(power, count, hz, tuple((c,) for c in used))
    out = [windows]
    lasts = pieces.times[-1][-1] - pieces.times[0][0]
    long = lasts * pieces.rate > GRID or sum(map(len, pieces.samples)) > COHERENT
    if long or any(_in_bursts(t, pieces.rate) for t in pieces.times):
        return out
    frames = [np.broadcast_to(np.eye(3), (len(pieces.samples), 3, 3))]
    if pieces.x.oriented.all():
        frames.append(np.swapaxes(pieces.x.to_device, 1, 2))
    triads = [some for some in TRIADS if set(some) <= set(used)]
    # electronics may be heard in one output alone, what shakes the base in none
    each = [(*windows.channel_groups, *triads), tuple(triads)]
    beside = _beside(windows, pieces)
    for frame, channel_groups in zip(frames, each, strict=False):
        power, unsteady, hz = _coherent_power(pieces, frame)
        level = np.array([np.interp(hz, windows.hz, row) for row in beside])
        level = _turned_level(pieces, frame, level)
        sure = 1 + SIGMAS / np.sqrt(max(len(pieces.samples) - 1, 1))
        level = np.where(unsteady > sure * level, unsteady, level)
        out.append(Spectrum(power, 1, hz, channel_groups, level))
    return out


def _beside(windows: Spectrum, pieces: WindowSamples) -> Array:
    """Variance of a sample of noise at each frequency, by its neighbours, (6, m).

    In windows side by side noise is known far better than in their sum with one phase:
    there, only frequencies that are as near as a whole recording can tell are alike. A
    line reaches as far as the taper of the shortest window does.
    """
    count, size = windows.count, windows.power.shape[1]
    cycle = pieces.rate / min(LONGEST, min(map(len, pieces.samples)))
    close = max(CLOSE, math.ceil(NEAR * cycle / windows.hz[1]))
    reach = close + max(FAR - CLOSE, close, -(-SURE // (2 * count)))
    kernel = np.ones(2 * reach + 1)
    kernel[reach - close : reach + close + 1] = 0.0
    there = np.convolve(np.ones(size), kernel)[reach:-reach]
    total = [np.convolve(row, kernel)[reach:-reach] for row in windows.power]
    out: Array = np.array(total) / np.maximum(there, 1.0) / count
    return out


def _turned_level(pieces: WindowSamples, frame: Array, level: Array) -> Array:
    """Mean power with one phase of noise of a variance (6, m), windows turned."""
    length = [len(samples) for samples in pieces.samples]
    square = np.array([(np.hanning(n) ** 2).sum() for n in length])
    shares = np.einsum("w,wij->ij", square, frame**2)
    return np.vstack([shares @ level[:3], shares @ level[3:]])


def _coherent_power(pieces: WindowSamples, frame: Array) -> tuple[Array, Array, Array]:
    """Power (6, m) of the whole recording, windows turned into a frame; Hz, (m,).

    And between them the power of noise as strong as what has no one phase: of W
    windows with Fourier sums X_w, (sum |X_w|^2 - |sum X_w|^2 / W) W / (W - 1). What
    trembles has that, and a line does not.
    """
    turned = []
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
    for values, at in zip(turned, pieces.times, strict=True):
        each += _squared_magnitude(_fourier_sums(values, at, rate, short))
    coarse = np.fft.rfftfreq(short, 1 / rate)
    total = np.array([np.interp(hz, coarse, row) for row in each])
    return power, (count * total - power) / (count - 1), hz


def _next_fast_length(n: int) -> int:
    """The next length with factors 2, 3 and 5 only, for a fast transform.

    `scipy.fft.next_fast_len` knows more lengths, but importing it takes 0.2 s.

    >>> _next_fast_length(1000), _next_fast_length(1001), _next_fast_length(4097)
    (1000, 1024, 4320)
    """
    odd = [int(3**i * 5**j) for i in range(5) for j in range(4)]
    return min(m << (-(-n // m) - 1).bit_length() for m in odd)


def _power_by_window(pieces: WindowSamples) -> tuple[Array, int, Array]:
    """Power, count and frequencies of all channels, summed over windows."""
    length = min(LONGEST, max(map(len, pieces.samples)))
    n = 1 << (length - 1).bit_length()
    total, count = np.zeros((6, n // 2 + 1)), 0
    for samples, t in zip(pieces.samples, pieces.times, strict=True):
        parts = max(1, len(samples) // LONGEST)
        for part in np.array_split(np.arange(len(t)), parts):
            taper = np.hanning(len(part))
            tapered = samples[part].T * taper
            spectrum = _fourier_sums(tapered, t[part], pieces.rate, n)
            total += _squared_magnitude(spectrum) / (taper @ taper)
            count += 1
    return total, count, np.fft.rfftfreq(n, 1 / pieces.rate)


def _fourier_sums(values: Array, t: Array, rate: float, n: int) -> Complex:
    """Fourier sums of samples (c, m) at the multiples of rate / n up to half the rate.

    They are taken at the times t (m,) of the samples, which in a log may be uneven. If
    the times are those of arrival, samples count as evenly spaced.
    """
    at = (t - t[0]) * rate
    even = np.ptp(at - np.arange(len(at))) < 0.5 / FINER
    if len(at) <= n and (even or _in_bursts(t, rate)):
        return np.fft.rfft(values, n)
    place = np.round(at * FINER).astype(np.intp) % (n * FINER)
    grid = [np.bincount(place, row, n * FINER) for row in values]
    whole: Complex = np.fft.rfft(np.array(grid))
    return whole[:, : n // 2 + 1]


def _in_bursts(t: Array, rate: float) -> bool:
    """Whether times are those of arrival: many steps are shorter than a device's."""
    return bool(np.mean(np.diff(t) * rate < BURST) > BURSTS)


def _squared_magnitude(spectrum: Complex) -> Array:
    square: Array = spectrum.real**2 + spectrum.imag**2
    return square


def _median_floor(power: Array) -> Array:
    """Running median (m,) of the power, interpolated between stretches."""
    parts = max(1, len(power) // (2 * BESIDE))
    each = len(power) // parts
    level = medians(power[: parts * each].reshape(parts, each))
    middle = (np.arange(parts) + 0.5) * each
    floor: Array = np.interp(np.arange(len(power)), middle, level)
    return np.maximum(floor, 1e-300)


def _floor_on_slope(power: Array, floor: Array) -> Array:
    """The floor, raised to the power close by where that is far above it.

    Drift and settling have more power at lower frequencies. A line must stand out of
    that slope, too.
    """
    n = len(power)
    # sums up to and including each; beyond the ends there is nothing to add
    totals = np.pad(np.cumsum(power), (FAR + 1, FAR + 1), "edge")
    totals[: FAR + 1] = 0.0
    counts = np.pad(np.arange(n + 1), (FAR, FAR + 1), "edge")
    sides = []
    for low, high in ((-FAR, -CLOSE), (CLOSE + 1, FAR + 1)):
        first, last = FAR + low, FAR + high
        count = counts[last : last + n] - counts[first : first + n]
        mean = (totals[last : last + n] - totals[first : first + n]) / np.maximum(
            count, 1
        )
        sides.append(np.where(count > 0, mean, np.inf))
    below, above = sides
    # at either end of the spectrum only one side has neighbours
    beside = np.where(np.isfinite(above), np.maximum(below, above), below)
    beside = np.where(np.isfinite(below), beside, above)
    falls = (beside > STEEP * floor) & (below > SLOPE * power)
    level: Array = np.where(falls, np.minimum(beside, power), floor)
    return level


def _log_gamma_tail(x: float, count: int) -> float:
    """Probability (ln) that Gamma(count) exceeds x: e^-x sum_k x^k / k!."""
    k = np.arange(count)
    terms = k * np.log(max(x, 1e-300)) - np.concatenate(
        [[0.0], np.cumsum(np.log(np.arange(1, count)))]
    )
    top = terms.max()
    return float(min(0.0, -x + top + np.log(np.exp(terms - top).sum())))
