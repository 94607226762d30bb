"""Where in the spectrum of the outputs at rest a line stands out.

Hann-windowed periodograms of the windows are summed; a line stands out of the median of
its neighbours. With W windows and white noise the sum at one frequency is Gamma(W)
about its mean W, so the odds of the highest of all frequencies and channels are known.
Source: D. Percival, A. Walden, Spectral Analysis for Physical Applications, chapter 10.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.reduce import Rows, Source, rate_of, spans
from fieldcal.effects import Experience
from fieldcal.frames import turn
from fieldcal.samples import Array

Complex = NDArray[np.complexfloating]

LONGEST = 32_768
"""Samples of one periodogram."""

CYCLES = 2.5
"""Fewest cycles in a window that make a line."""

BESIDE = 40
"""Neighbours that give the floor, to either side."""

CLOSE, FAR = 5, 12
"""Neighbours that no taper reaches, and that are still near."""

STEEP = 4.0
"""Times the floor that these have to have to be taken for it."""

SLOPE = 0.3
"""Part of the power at a frequency that is below it on a slope; beside a line, less."""

ODDS = 1e-3
"""Of a line where there is none, over all frequencies and channels."""

NEAR = 2.0
"""Distance between two lines, in cycles of the shortest window."""

LOOKS = 10
"""Spectra looked at."""

COHERENT = 1 << 18
"""Samples up to which windows are put together with one phase."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Samples of each window about their mean, and where the device was in it."""

    x: Experience
    samples: tuple[Array, ...]
    times: tuple[Array, ...]
    noise: Array
    rate: float


def pieces_of(source: Source, rows: Rows) -> Pieces:
    """Windows of a recording that are long enough.

    Outputs of which rows say nothing, as of gravity on a table that turns, are zero.
    """
    block = source.block
    first = {int(p): i for i, p in reversed(list(enumerate(rows.x.position)))}
    kept, samples, times = [], [], []
    for p, (a, b) in enumerate(spans(block, source.about)):
        if b - a >= 64 and p in first:
            kept.append(first[p])
            known = source.usable[a:b] & rows.used[first[p]]
            six = np.where(known, block[a:b].six, np.nan)
            samples.append(_flat(block.t[a:b], six))
            times.append(block.t[a:b])
    x = rows.x
    some = np.array(kept, dtype=np.intp)
    at = Experience.at_rest(
        x.alpha[some], x.beta[some], x.gravity, f=x.f[some], mounting=x.mounting
    )
    return Pieces(at, tuple(samples), tuple(times), rows.noise, rate_of(block))


def _flat(t: Array, six: Array) -> Array:
    """Samples without mean and slope; zero where not usable."""
    s = (t - t.mean()) / max(np.ptp(t), 1e-9)
    known = np.isfinite(six)
    count = np.maximum(known.sum(axis=0), 1)
    out = np.where(known, six, 0.0)
    out = np.where(known, out - out.sum(axis=0) / count, 0.0)
    slope = (s @ out) / np.maximum((s[:, None] ** 2 * known).sum(axis=0), 1e-12)
    flat: Array = np.where(known, out - s[:, None] * slope, 0.0)
    return flat


def highest(pieces: Pieces, taken: Sequence[float]) -> float | None:
    """Frequency of the line that stands out most, None if none does.

    Near one that is taken already, what is left belongs to it.
    """
    shortest = min(LONGEST, min(map(len, pieces.samples))) / pieces.rate
    low = max(0.05, CYCLES / shortest)
    best, near = np.log(ODDS), None
    for power, count, hz in _spectra(pieces):
        band = hz >= low
        for other in taken:
            band &= np.abs(hz - other) > NEAR / shortest
        if band.sum() < 4 * BESIDE:
            continue
        stands = np.zeros(int(band.sum()))
        for channel in power[band].T:
            # median of Gamma(W) over its mean, by Wilson and Hilferty
            level = _floor(channel) / (1 - 1 / (9 * count)) ** 3
            stands += channel / _on_a_slope(channel, level) * count
        degrees = count * power.shape[1]
        at = int(np.argmax(stands))
        odds = _beyond(float(stands[at]), degrees) + np.log(LOOKS * len(stands))
        if odds < best:
            best, near = odds, float(hz[band][at])
    return near


def _spectra(pieces: Pieces) -> Iterator[tuple[Array, int, Array]]:
    """Power of one or more channels, periodograms summed in it, and frequencies, Hz.

    Channel by channel window by window; and triads with one phase throughout, in
    the device's axes and, where the angles are known, in the base's. Windows are
    tapered: what settles at the start of each is no line, though it comes as often.
    """
    power, count, hz = _power(pieces)
    used = np.flatnonzero(power.any(axis=0))
    for c in used:
        yield power[:, [c]], count, hz
    if sum(map(len, pieces.samples)) > COHERENT:
        return
    frames = [np.broadcast_to(np.eye(3), (len(pieces.samples), 3, 3))]
    if pieces.x.oriented.all():
        turned = turn(pieces.x.alpha, pieces.x.beta)
        frames.append(np.moveaxis(pieces.x.mounting.T @ turned, 1, 2))
    for frame in frames:
        whole, hz = _one_phase(pieces, frame)
        for triad in ([0, 1, 2], [3, 4, 5], list(range(6))):
            if set(triad) <= set(used.tolist()):
                yield whole[:, triad], 1, hz


def _one_phase(pieces: Pieces, frame: Array) -> tuple[Array, Array]:
    """Power of the whole recording, windows turned into a frame, nothing between."""
    start, end = pieces.times[0][0], pieces.times[-1][-1]
    whole = np.zeros((int(round((end - start) * pieces.rate)) + 1, 6))
    for samples, t, to_frame in zip(pieces.samples, pieces.times, frame, strict=True):
        at = np.round((t - start) * pieces.rate).astype(np.intp)
        taper = np.hanning(len(t))[:, None]
        whole[at, :3] = taper * samples[:, :3] @ to_frame.T
        whole[at, 3:] = taper * samples[:, 3:] @ to_frame.T
    n = 2 << (len(whole) - 1).bit_length()
    return np.abs(np.fft.rfft(whole, n, axis=0)) ** 2, np.fft.rfftfreq(
        n, 1 / pieces.rate
    )


def _power(pieces: Pieces) -> tuple[Array, int, Array]:
    length = min(LONGEST, max(map(len, pieces.samples)))
    n = 1 << (length - 1).bit_length()
    total, count = np.zeros((n // 2 + 1, 6)), 0
    for samples in pieces.samples:
        parts = max(1, len(samples) // LONGEST)
        for part in np.array_split(samples, parts):
            taper = np.hanning(len(part))
            spectrum = np.fft.rfft(part * taper[:, None], n, axis=0)
            total += np.abs(spectrum) ** 2 / (taper @ taper)
            count += 1
    return total, count, np.fft.rfftfreq(n, 1 / pieces.rate)


def _floor(power: Array) -> Array:
    """Running median, by stretches."""
    parts = max(1, len(power) // (2 * BESIDE))
    each = len(power) // parts
    level = np.median(power[: parts * each].reshape(parts, each), axis=1)
    middle = (np.arange(parts) + 0.5) * each
    floor: Array = np.interp(np.arange(len(power)), middle, level)
    return np.maximum(floor, 1e-300)


def _on_a_slope(power: Array, floor: Array) -> Array:
    """The floor, or what lies close to either side where that is far above it.

    What settles or drifts has the more power the lower the frequency; a line stands out
    of that, too.
    """
    totals = np.concatenate([[0.0], np.cumsum(power)])
    at = np.arange(len(power))
    sides = []
    for low, high in ((-FAR, -CLOSE), (CLOSE + 1, FAR + 1)):
        first = np.clip(at + low, 0, len(power))
        last = np.clip(at + high, 0, len(power))
        mean = (totals[last] - totals[first]) / np.maximum(last - first, 1)
        sides.append(np.where(last > first, mean, np.inf))
    below, above = sides
    # beyond the lowest frequency there is but more of a slope
    beside = np.where(np.isfinite(above), np.maximum(below, above), below)
    beside = np.where(np.isfinite(below), beside, above)
    falls = (beside > STEEP * floor) & (below > SLOPE * power)
    level: Array = np.where(falls, np.minimum(beside, power), floor)
    return level


def _beyond(x: float, count: int) -> float:
    """Probability (ln) that Gamma(count) exceeds x: e^-x sum_k x^k / k!."""
    k = np.arange(count)
    terms = k * np.log(max(x, 1e-300)) - np.concatenate(
        [[0.0], np.cumsum(np.log(np.arange(1, count)))]
    )
    top = terms.max()
    return float(min(0.0, -x + top + np.log(np.exp(terms - top).sum())))


def wave_of(t: Array, hz: float) -> Complex:
    """exp(2 pi i hz t), (n,)."""
    wave: Complex = np.exp(2j * np.pi * hz * t)
    return wave
