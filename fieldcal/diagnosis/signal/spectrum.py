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
from fieldcal.diagnosis.signal.line import Remains, Tone, remains, tuned
from fieldcal.diagnosis.signal.moments import Moments, moments_of
from fieldcal.diagnosis.signal.periodogram import Peak, highest, noise_near, spectra_of
from fieldcal.diagnosis.signal.pieces import (
    Complex,
    Pieces,
    held_in,
    line_of,
    pieces_of,
    places_of,
    stretches,
    take_out,
)
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.physics.effect import Line

MOST, LOOKS = 4, 3
"""Lines looked for, and how often one that stands out may turn out to be none."""


def tones(source: RowSource, rows: Rows) -> list[tuple[Tone, Remains]]:
    """Lines in a recording, the strongest first, with what is left of them."""
    pieces = pieces_of(source, rows)
    found: list[tuple[Tone, Remains]] = []
    looked: list[Peak] = []
    spectra = spectra_of(pieces) if pieces.samples else []
    while spectra and len(found) < MOST and len(looked) < LOOKS + len(found):
        peak = highest(pieces, spectra, looked)
        if peak is None:
            break
        looked.append(peak)
        heard = replace(pieces, noise=peak.noise)
        if (tone := _explained(heard, peak.hz)) is None:
            continue  # something else has much power there, and may hide a line
        heard = replace(pieces, noise=_noise_beside(heard, tone))
        if (tone := _explained(heard, peak.hz)) is None:
            continue  # flicker is as strong there
        left = remains(heard, tone)
        if left.predictive_score[tone.clear].sum() > 0:
            found.append((tone, left))
            looked[-1] = replace(peak, hz=tone.hz, low=tone.hz, high=tone.hz)
            _subtract(pieces, tone)
            spectra = spectra_of(pieces)
    return found


def without(
    block: Block, source: RowSource, rows: Rows, found: Sequence[Tone]
) -> Block:
    """The samples less the lines: of all windows, and on the way what sensors add."""
    triads = [block.acc, block.gyr]
    held = held_in(source, rows)
    x = places_of(rows, held)
    for tone in found:
        response = tone.effect.response(x, tone.hz) @ tone.causes
        where = [
            (slice(a, b), seen) for (_, a, b), seen in zip(held, response, strict=True)
        ]
        if tone.effect.kind == "sensor":
            where = [(slice(0, len(block)), response[0])]
        for i, own in enumerate((slice(0, 3), slice(3, 6))):
            if response[:, own].any():
                triads[i] = triads[i].copy()
                for span, seen in where:
                    take_out(triads[i][span], block.t[span], tone.hz, seen[own])
    return replace(block, acc=triads[0], gyr=triads[1])


def _explained(pieces: Pieces, near: float) -> Tone | None:
    """The line near a frequency under the explanation that needs least."""
    moments = moments_of(pieces, near)
    best = _best(pieces, near, moments)
    if best and _coherent_part(pieces, best, moments) <= thresholds.ONE_LINE:
        best = _beside_tremor(pieces, best, moments)
    return best if best and _in_both_halves(pieces, best) else None


def _beside_tremor(pieces: Pieces, tone: Tone, moments: Moments) -> Tone | None:
    """The line where some outputs tremble at its frequency, and others may have it.

    Each output is as noisy as its windows differ by. That is told by few of them, and
    the gain is that of Student's t distribution with n degrees of freedom,
    n / 2 ln(1 + chi2 / n) in place of chi2 / 2.
    """
    if len(moments.counts) < 2:
        return None
    scatter = _between_windows(pieces, tone, moments)
    noisy = replace(pieces, noise=np.maximum(pieces.noise, scatter))
    best = _best(noisy, moments.near, moments)
    if best is None or _coherent_part(noisy, best, moments) <= thresholds.ONE_LINE:
        return None
    n = 2 * (len(moments.counts) - 1) * len(best.channels)
    less = best.chi2 / 2 - n / 2 * np.log1p(best.chi2 / n)
    return best if best.gain - less > _least_gain(pieces) else None


def _best(pieces: Pieces, near: float, moments: Moments) -> Tone | None:
    """The effect that explains most near a frequency, if it is not by chance."""
    tried = []
    for effect in catalogue().values():
        if not isinstance(effect, Line) or not effect.band[0] <= near <= effect.band[1]:
            continue
        if effect.kind == "motion" and not pieces.x.oriented.all():
            continue
        tried.append(tuned(pieces, effect, moments))
    best = max(tried, key=lambda tone: tone.gain, default=None)
    if best is None or best.gain <= _least_gain(pieces) or not best.channels:
        return None
    return best


def _least_gain(pieces: Pieces) -> float:
    """Gain of a line that chance does not make in so many samples."""
    places = np.log(sum(map(len, pieces.samples)))
    return float(places - np.log(thresholds.LINE_BY_CHANCE))


def _off_the_line(
    pieces: Pieces, tone: Tone, moments: Moments
) -> tuple[Complex, Complex]:
    """Amplitudes of the windows, and how far they are from those of one steady line."""
    seen = moments.seen(np.array([tone.hz - moments.near]))[0]
    modelled = tone.effect.response(pieces.x, tone.hz) @ tone.causes
    return seen, seen - modelled


def _between_windows(pieces: Pieces, tone: Tone, moments: Moments) -> Array:
    """Noise of a sample that makes windows differ as they do beside a line, (6,)."""
    _, off = _off_the_line(pieces, tone, moments)
    square = moments.counts @ np.abs(off) ** 2 / 4  # the variance beside (1) of moments
    scatter: Array = np.sqrt(square / (len(off) - 1))
    return scatter


def _noise_beside(pieces: Pieces, tone: Tone) -> Array:
    """Noise at the frequency of a line once the line is taken out, (6,).

    With the line in the samples nobody knows: in short windows it reaches as far as the
    neighbours that tell the noise.
    """
    _subtract(pieces, tone)
    (channels, *_) = spectra_of(pieces)
    _subtract(pieces, replace(tone, causes=-tone.causes))
    return np.maximum(pieces.noise, noise_near(channels, tone.hz, pieces.noise))


def _in_both_halves(pieces: Pieces, tone: Tone) -> bool:
    """Whether a line takes of the squares in either half of the windows.

    What fades after turns has lines, too, where positions follow one another evenly.
    """
    clear = tone.clear
    seen = (tone.effect.response(pieces.x, tone.hz) @ tone.causes)[:, clear]
    taken = np.zeros(2)
    for s, t, one in zip(pieces.samples, pieces.times, seen, strict=True):
        middle = -(-len(t) // 2)
        for half, ends in enumerate(((0, middle), (middle, len(t)))):
            for some in stretches(*ends):
                line = line_of(t[some], tone.hz, one)
                fallen = ((2 * s[some, clear] - line) * line).sum(axis=0)
                taken[half] += (fallen / pieces.noise[clear] ** 2).sum()
    # half of E varies by 2 sqrt(E / 2)
    sigma = 2 * np.sqrt(max(float(taken.sum()), 0.0) / 2)
    most = taken.min() + thresholds.LINE_LASTS_SIGMAS * sigma
    return bool(most > thresholds.LINE_LASTS * taken.sum())


def _coherent_part(pieces: Pieces, tone: Tone, moments: Moments) -> float:
    """Part of the energy at a line's frequency that one steady line takes.

    A line keeps amplitude and phase through all windows. A hand that trembles or a base
    that is pushed has as much energy there, but another phase each time.
    """
    clear = tone.clear
    seen, off = _off_the_line(pieces, tone, moments)
    half = moments.counts[:, None] / 2
    energy = (half * np.abs(seen[:, clear]) ** 2).sum(axis=0)
    left = (half * np.abs(off[:, clear]) ** 2).sum(axis=0)
    weight = 1 / pieces.noise[clear] ** 2
    noise = 2.0 * len(half) * len(clear)
    return float(1 - (weight @ left - noise) / max(weight @ energy - noise, 1e-9))


def _subtract(pieces: Pieces, tone: Tone) -> None:
    """Take a line out of the samples, in place: there are many of them."""
    response = tone.effect.response(pieces.x, tone.hz) @ tone.causes
    for samples, t, seen in zip(pieces.samples, pieces.times, response, strict=True):
        take_out(samples, t, tone.hz, seen)
