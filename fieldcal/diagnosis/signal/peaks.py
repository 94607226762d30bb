"""Significant peaks of the power spectra of the outputs at rest.

With W windows and white noise the power at one frequency, in units of the noise, has
the distribution Gamma(W), which gives the probability of the highest value of all
frequencies and channels.
Source: D. Percival, A. Walden, Spectral Analysis for Physical Applications, chapter 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.diagnosis.signal.periodogram import Spectrum, noise_near
from fieldcal.diagnosis.signal.pieces import WindowSamples
from fieldcal.model import detections, resolutions, thresholds


@dataclass(frozen=True, slots=True)
class Peak:
    """A peak of the power spectrum, Hz.

    Attributes
    ----------
    hz : frequency of the maximum
    low, high : range in which the power is above the floor; of a line, its frequency
    noise : (6,) standard deviation of a sample of white noise with the power beside the
        peak: filters and bearings make noise that is not white
    channels : group of channels whose summed power it stands out of

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
    shortest = pieces.shortest_samples(resolutions.PERIODOGRAM_SAMPLES) / pieces.rate
    low, reach = (
        max(detections.LOWEST_LINE_HZ, detections.MIN_CYCLES / shortest),
        detections.LINE_DISTANCE_CYCLES / shortest,
    )
    one_phase = [s for s in spectra if s.count == 1]
    peak = _significant(one_phase, low, reach, taken)
    windows, rejected = [s for s in spectra if s.count > 1], list[Peak]()
    while peak is None:
        peak = _significant(windows, low, reach, taken, rejected)
        if peak is None:
            return None
        if one_phase and not _keeps_phase_nearby(one_phase, peak, reach):
            rejected.append(peak)
            peak = None
    # a line in short windows reaches its neighbours
    near = noise_near(spectra[0], peak.hz, pieces.noise)
    return replace(peak, noise=np.minimum(near, pieces.noise))


def _significant(
    spectra: Sequence[Spectrum],
    low: float,
    reach: float,
    taken: Sequence[Peak],
    rejected: Sequence[Peak] = (),
) -> Peak | None:
    """The most significant peak of some spectra, None if chance may have made it."""
    highest = [_highest_in_spectrum(s, low, reach, taken, rejected) for s in spectra]
    odds, peak = min(filter(None, highest), key=itemgetter(0), default=(0.0, None))
    return peak if odds < np.log(thresholds.LINE_BY_CHANCE) else None


def _keeps_phase_nearby(
    one_phase: Sequence[Spectrum], peak: Peak, reach: float
) -> bool:
    """Whether one phase lasts near a peak of the windows, as it does for a line.

    Only the channels of the peak are looked at.
    """
    low, high = peak.hz - reach, peak.hz + reach
    for spectrum in one_phase:
        near = (spectrum.hz >= low) & (spectrum.hz <= high)
        stands = [spectrum.power_over_noise(c, near) for c in peak.channels]
        odds = _log_gamma_tail(float(np.max(stands)), 1) + np.log(near.sum())
        if odds < np.log(thresholds.LINE_BY_CHANCE):
            return True
    return False


def _highest_in_spectrum(
    spectrum: Spectrum,
    low: float,
    reach: float,
    taken: Sequence[Peak],
    rejected: Sequence[Peak],
) -> tuple[float, Peak] | None:
    """The highest peak of a spectrum, with the ln probability of one by chance.

    Frequencies near peaks in `taken` are left out, and near those in `rejected` in the
    channels of these.
    """
    band, count = spectrum.hz >= low, spectrum.count
    hz = spectrum.hz[band]
    stands = {c: spectrum.power_over_noise(c, band) for c in spectrum.channels}
    best: tuple[float, Peak] | None = None
    for channels in spectrum.channel_groups:
        occupied = [*taken, *(p for p in rejected if set(p.channels) & set(channels))]
        free = _away_from(hz, occupied, reach)
        if free.sum() < 4 * detections.FLOOR_NEIGHBOURS:
            continue
        total = np.sum([stands[c] for c in channels], axis=0)
        at = int(np.argmax(np.where(free, total, 0.0)))
        odds = _log_gamma_tail(float(total[at]), count * len(channels))
        odds += np.log(detections.SEARCHED_GROUPS * len(total))
        if best is None or odds < best[0]:
            peak = _peak_at(hz, total / (count * len(channels)), at)
            best = odds, replace(peak, channels=channels)
    return best


def _away_from(hz: Array, peaks: Sequence[Peak], reach: float) -> Mask:
    """Frequencies that are close to none of some peaks, (m,)."""
    free = np.ones(len(hz), dtype=bool)
    for peak in peaks:
        free &= (hz < peak.low - reach) | (hz > peak.high + reach)
    return free


def _peak_at(hz: Array, power: Array, at: int) -> Peak:
    """The peak at a frequency; power (m,) in units of the floor.

    It reaches as far as the smoothed power stays above the floor: a machine whose speed
    varies makes a broad peak, which is no line.
    """
    kernel = np.ones(2 * detections.FURTHEST_NEIGHBOUR + 1) / (
        2 * detections.FURTHEST_NEIGHBOUR + 1
    )
    low = np.flatnonzero(
        np.convolve(power, kernel, "same") < detections.PEAK_EDGE_RATIO
    )
    below, above = low[low < at], low[low > at]
    first = int(below[-1]) if len(below) else 0
    last = int(above[0]) if len(above) else len(hz) - 1
    return Peak(float(hz[at]), float(hz[first]), float(hz[last]), np.zeros(6))


def _log_gamma_tail(x: float, count: int) -> float:
    """Probability (ln) that Gamma(count) exceeds x: e^-x sum_k x^k / k!."""
    k = np.arange(count)
    terms = k * np.log(max(x, 1e-300)) - np.concatenate(
        [[0.0], np.cumsum(np.log(np.arange(1, count)))]
    )
    top = terms.max()
    return float(min(0.0, -x + top + np.log(np.exp(terms - top).sum())))
