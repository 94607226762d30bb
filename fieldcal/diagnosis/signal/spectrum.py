"""Lines in the spectrum of the outputs at rest.

A line found (`periodogram`) is fitted (`line`) to the samples of all windows, with one
phase throughout: with any amplitude in each output, or with those that a `Line` effect
makes from few causes. It is accepted if the rest of the recording predicts it in the
samples that were left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.diagnosis.signal.line import (
    LineRemainder,
    SpectralLine,
    line_remainder,
    tune_line,
)
from fieldcal.diagnosis.signal.moments import Moments, moments_of
from fieldcal.diagnosis.signal.peaks import Peak, highest_peak
from fieldcal.diagnosis.signal.periodogram import (
    compute_spectra,
    noise_near,
    window_spectrum,
)
from fieldcal.diagnosis.signal.pieces import (
    Complex,
    WindowSamples,
    chunks,
    evaluate_line,
    experience_in_windows,
    long_windows,
    samples_of_windows,
    subtract_line,
)
from fieldcal.effects import catalogue
from fieldcal.model import thresholds, tolerances
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.row_source import RowSource
from fieldcal.physics.effect import Line


def find_lines(
    source: RowSource, rows: Rows
) -> list[tuple[SpectralLine, LineRemainder]]:
    """Lines in a recording, the strongest first, each with its remainder."""
    pieces = samples_of_windows(source, rows)
    found: list[tuple[SpectralLine, LineRemainder]] = []
    looked: list[Peak] = []
    spectra = compute_spectra(pieces) if pieces.samples else []
    while (
        spectra
        and len(found) < tolerances.MAX_LINES
        and len(looked) < tolerances.MAX_REJECTED_PEAKS + len(found)
    ):
        peak = highest_peak(pieces, spectra, looked)
        if peak is None:
            break
        looked.append(peak)
        heard = replace(pieces, noise=peak.noise)
        if (tone := _explain_line(heard, peak.hz)) is None:
            continue  # something else has much power there, and may hide a line
        heard = replace(pieces, noise=_noise_beside(heard, tone))
        if (tone := _explain_line(heard, peak.hz)) is None:
            continue  # flicker is as strong there
        left = line_remainder(heard, tone)
        if left.predictive_score[tone.clear_channels].sum() > 0:
            found.append((tone, left))
            looked[-1] = replace(peak, hz=tone.hz, low=tone.hz, high=tone.hz)
            _subtract(pieces, tone)
            spectra = compute_spectra(pieces)
    return found


def subtract_lines(
    block: Block, source: RowSource, rows: Rows, found: Sequence[SpectralLine]
) -> Block:
    """Subtract lines from the windows; those of the sensors from turns as well."""
    triads = [block.acc, block.gyr]
    held = long_windows(source, rows)
    x = experience_in_windows(rows, held)
    for tone in found:
        response = tone.amplitudes(x)
        pairs = zip(held, response, strict=True)
        where = [(slice(a, b), in_window) for (_, a, b), in_window in pairs]
        if tone.effect.kind == "sensor":
            where = [(slice(0, len(block)), response[0])]
        for i, own in enumerate((slice(0, 3), slice(3, 6))):
            if response[:, own].any():
                triads[i] = triads[i].copy()
                for span, in_window in where:
                    subtract_line(
                        triads[i][span], block.t[span], tone.hz, in_window[own]
                    )
    return replace(block, acc=triads[0], gyr=triads[1])


def _explain_line(pieces: WindowSamples, near: float) -> SpectralLine | None:
    """The line near a frequency with the effect that explains it best; or None."""
    moments = moments_of(pieces, near)
    best = _best_effect(pieces, near, moments)
    if best and _coherent_part(pieces, best, moments) <= thresholds.ONE_LINE:
        best = _beside_tremor(pieces, best, moments)
    return best if best and _in_both_halves(pieces, best) else None


def _beside_tremor(
    pieces: WindowSamples, tone: SpectralLine, moments: Moments
) -> SpectralLine | None:
    """The line, if it stands out of the tremor of some outputs at its frequency.

    An output whose waves keep no phase is as noisy as they scatter between windows; the
    others have the noise that they have. Since a scatter is estimated from few windows,
    the gain by it is that of Student's t distribution with n degrees of freedom,
    n / 2 ln(1 + chi2 / n) in place of chi2 / 2.
    """
    if len(moments.counts) < 2:
        return None
    heard, best = pieces, tone
    trembles = np.zeros(len(pieces.noise), dtype=bool)
    while _coherent_part(heard, best, moments) <= thresholds.ONE_LINE:
        if trembles[best.clear_channels].all():
            return None
        trembles[best.clear_channels] = True
        scatter = _scatter_between_windows(pieces, best, moments)
        noise = np.where(trembles, np.maximum(pieces.noise, scatter), pieces.noise)
        heard = replace(pieces, noise=noise)
        if (again := _best_effect(heard, moments.near, moments)) is None:
            return None
        best = again
    by_tremor = [c for c in best.clear_channels if trembles[c]]
    n = 2 * (len(moments.counts) - 1) * max(len(by_tremor), 1)
    chi2 = float(_explained(heard, best, moments)[by_tremor].sum())
    less = chi2 / 2 - n / 2 * np.log1p(chi2 / n)
    return best if best.gain - less > _least_gain(pieces) else None


def _best_effect(
    pieces: WindowSamples, near: float, moments: Moments
) -> SpectralLine | None:
    """The line of the effect that explains most near a frequency, if significant."""
    tried = []
    for effect in catalogue().values():
        if not isinstance(effect, Line) or not effect.band[0] <= near <= effect.band[1]:
            continue
        if effect.kind == "motion" and not pieces.x.oriented.all():
            continue
        tried.append(tune_line(pieces, effect, moments))
    best = max(tried, key=lambda tone: tone.gain, default=None)
    if best is None or best.gain <= _least_gain(pieces) or not best.channels:
        return None
    return best


def _least_gain(pieces: WindowSamples) -> float:
    """Least gain of a significant line, given the number of samples."""
    places = np.log(sum(map(len, pieces.samples)))
    return float(places - np.log(thresholds.LINE_BY_CHANCE))


def _deviations_from_line(
    pieces: WindowSamples, tone: SpectralLine, moments: Moments
) -> tuple[Complex, Complex]:
    """Amplitudes of the windows, and their deviations from one steady line."""
    measured = moments.amplitudes(np.array([tone.hz - moments.near]))[0]
    return measured, measured - tone.amplitudes(pieces.x)


def _explained(pieces: WindowSamples, tone: SpectralLine, moments: Moments) -> Array:
    """Decrease of the whitened squares of each output by a line, (6,)."""
    measured, off = _deviations_from_line(pieces, tone, moments)
    fallen: Array = moments.counts @ (np.abs(measured) ** 2 - np.abs(off) ** 2) / 2
    return fallen / pieces.noise**2


def _scatter_between_windows(
    pieces: WindowSamples, tone: SpectralLine, moments: Moments
) -> Array:
    """Sample noise (6,) that would make amplitudes scatter as they do about a line."""
    _, off = _deviations_from_line(pieces, tone, moments)
    square = moments.counts @ np.abs(off) ** 2 / 4  # the variance beside (1) of moments
    scatter: Array = np.sqrt(square / (len(off) - 1))
    return scatter


def _noise_beside(pieces: WindowSamples, tone: SpectralLine) -> Array:
    """Noise (6,) at the frequency of a line, measured without the line.

    In short windows a line reaches the neighbouring frequencies that give the noise, so
    it is subtracted first and restored afterwards.
    """
    _subtract(pieces, tone)
    channels = window_spectrum(pieces)
    _subtract(pieces, replace(tone, causes=-tone.causes))
    return np.maximum(pieces.noise, noise_near(channels, tone.hz, pieces.noise))


def _in_both_halves(pieces: WindowSamples, tone: SpectralLine) -> bool:
    """Whether a line reduces the squares in both halves of the windows.

    A decay after each turn makes a peak, too, if the turns are evenly spaced; but it is
    present in the first half only.
    """
    clear = tone.clear_channels
    response = tone.amplitudes(pieces.x)[:, clear]
    taken = np.zeros(2)
    for s, t, one in zip(pieces.samples, pieces.times, response, strict=True):
        middle = -(-len(t) // 2)
        for half, ends in enumerate(((0, middle), (middle, len(t)))):
            for chunk in chunks(*ends):
                line = evaluate_line(t[chunk], tone.hz, one)
                fallen = ((2 * s[chunk, clear] - line) * line).sum(axis=0)
                taken[half] += (fallen / pieces.noise[clear] ** 2).sum()
    # the part of E in one half has the standard deviation 2 sqrt(E / 2)
    sigma = 2 * np.sqrt(max(float(taken.sum()), 0.0) / 2)
    most = taken.min() + thresholds.WITHIN_NOISE * sigma
    return bool(most > thresholds.LINE_LASTS * taken.sum())


def _coherent_part(
    pieces: WindowSamples, tone: SpectralLine, moments: Moments
) -> float:
    """Part of the energy at a line's frequency that one steady line explains.

    A line keeps amplitude and phase through all windows. Hand tremor or pushes of the
    base have as much energy there, but a different phase in each window.
    """
    clear = tone.clear_channels
    measured, off = _deviations_from_line(pieces, tone, moments)
    half = moments.counts[:, None] / 2
    energy = (half * np.abs(measured[:, clear]) ** 2).sum(axis=0)
    left = (half * np.abs(off[:, clear]) ** 2).sum(axis=0)
    weight = 1 / pieces.noise[clear] ** 2
    noise = 2.0 * len(half) * len(clear)
    return float(1 - (weight @ left - noise) / max(weight @ energy - noise, 1e-9))


def _subtract(pieces: WindowSamples, tone: SpectralLine) -> None:
    """Subtract a line from the samples, in place to save memory."""
    response = tone.amplitudes(pieces.x)
    for samples, t, amplitudes in zip(
        pieces.samples, pieces.times, response, strict=True
    ):
        subtract_line(samples, t, tone.hz, amplitudes)
