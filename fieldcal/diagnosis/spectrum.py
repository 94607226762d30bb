"""Lines in the spectrum of the outputs at rest.

Hann-windowed periodograms of the windows are summed; a line stands out of the median of
its neighbours. With W windows and white noise the sum at one frequency is Gamma(W)
about its mean W, so the odds of the highest of all frequencies and channels are known.
A line found is fitted to the samples of all windows, one phase throughout: as any
amplitude in each output, or as what a `Line` effect makes of few causes. With E the
squares it takes, the frequency is known to 1 / (2 pi std(t) sqrt(E)). Source: D. Rife,
R. Boorstyn, Single-tone parameter estimation, 1974.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.reduce import Rows, Source, rate_of, spans
from fieldcal.effects import Experience, Line, catalogue
from fieldcal.samples import CHANNELS, Array, Block

Complex = NDArray[np.complexfloating]

LONGEST = 32_768
"""Samples of one periodogram."""

CYCLES = 2.5
"""Fewest cycles in a window that make a line."""

BESIDE = 40
"""Neighbours that give the floor, to either side."""

ODDS = 1e-6
"""Of a line where there is none, over all frequencies and channels."""

NEAR = 2.0
"""Distance between two lines, in cycles of the shortest window."""

STEADY = 0.5
"""Part of the energy that one amplitude and phase must take to be a line."""

MOST = 4
CLEAR = 5.0
"""Standard deviations from which a channel is said to have the line."""


@dataclass(frozen=True, slots=True)
class Tone:
    """A line with its explanation.

    Attributes
    ----------
    effect : hum, sway ...
    hz : frequency
    causes : (m,) complex amplitudes of the effect's causes
    values, sigmas : by parameter name
    channels : outputs in which it stands out
    amplitude : (6,) mean amplitude in the outputs
    chi2 : by how much the squares fall with it

    """

    effect: Line
    hz: float
    causes: Complex
    values: dict[str, float]
    sigmas: dict[str, float]
    channels: tuple[str, ...]
    amplitude: Array
    chi2: float


@dataclass(frozen=True, slots=True)
class _Pieces:
    """Samples of each window about their mean, and where the device was in it."""

    x: Experience
    samples: tuple[Array, ...]
    times: tuple[Array, ...]
    noise: Array
    rate: float


def tones(source: Source, rows: Rows) -> list[Tone]:
    """Lines in a recording, the strongest first."""
    pieces = _pieces(source, rows)
    found: list[Tone] = []
    while pieces.samples and len(found) < MOST:
        near = _highest(pieces, [tone.hz for tone in found])
        tone = _explained(pieces, near) if near is not None else None
        if tone is None:
            break
        found.append(tone)
        pieces = _without(pieces, tone)
    return found


def without(block: Block, source: Source, rows: Rows, found: Sequence[Tone]) -> Block:
    """The samples of all windows less the lines."""
    six = block.six
    where = _pieces(source, rows)
    for tone in found:
        response = tone.effect.response(where.x, tone.hz) @ tone.causes
        for seen, t in zip(response, where.times, strict=True):
            at = np.searchsorted(block.t, t)
            six[at] -= np.real(_wave(t, tone.hz)[:, None] * seen)
    return replace(block, acc=six[:, :3], gyr=six[:, 3:])


def _pieces(source: Source, rows: Rows) -> _Pieces:
    block = source.block
    first = {int(p): i for i, p in reversed(list(enumerate(rows.x.position)))}
    kept, samples, times = [], [], []
    for p, (a, b) in enumerate(spans(block, source.about)):
        if b - a >= 64 and p in first:
            kept.append(first[p])
            six = np.where(source.usable[a:b], block[a:b].six, np.nan)
            samples.append(_flat(block.t[a:b], six))
            times.append(block.t[a:b])
    x = rows.x
    some = np.array(kept, dtype=np.intp)
    at = Experience.at_rest(
        x.alpha[some], x.beta[some], x.gravity, f=x.f[some], mounting=x.mounting
    )
    return _Pieces(at, tuple(samples), tuple(times), rows.noise, rate_of(block))


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


def _highest(pieces: _Pieces, taken: Sequence[float]) -> float | None:
    """Frequency of the line that stands out most, None if none does.

    Near one that is taken already, what is left belongs to it.
    """
    power, count, hz = _power(pieces)
    shortest = min(LONGEST, min(map(len, pieces.samples))) / pieces.rate
    low = max(0.05, CYCLES / shortest)
    band = hz >= low
    for other in taken:
        band &= np.abs(hz - other) > NEAR / shortest
    if band.sum() < 4 * BESIDE:
        return None
    best, near = np.log(ODDS), None
    for c in range(6):
        channel = power[band, c]
        if not channel.any():
            continue
        # median of Gamma(W) over its mean, by Wilson and Hilferty
        stands = channel / _floor(channel) * count * (1 - 1 / (9 * count)) ** 3
        at = int(np.argmax(stands))
        odds = _beyond(float(stands[at]), count) + np.log(6 * len(channel))
        if odds < best:
            best, near = odds, float(hz[band][at])
    return near


def _power(pieces: _Pieces) -> tuple[Array, int, Array]:
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
    parts = np.array_split(np.arange(len(power)), max(1, len(power) // (2 * BESIDE)))
    level = [float(np.median(power[p])) for p in parts]
    floor: Array = np.interp(np.arange(len(power)), [p.mean() for p in parts], level)
    return np.maximum(floor, 1e-300)


def _beyond(x: float, count: int) -> float:
    """Probability (ln) that Gamma(count) exceeds x: e^-x sum_k x^k / k!."""
    k = np.arange(count)
    terms = k * np.log(max(x, 1e-300)) - np.concatenate(
        [[0.0], np.cumsum(np.log(np.arange(1, count)))]
    )
    top = terms.max()
    return float(min(0.0, -x + top + np.log(np.exp(terms - top).sum())))


def _wave(t: Array, hz: float) -> Complex:
    wave: Complex = np.exp(2j * np.pi * hz * t)
    return wave


def _explained(pieces: _Pieces, near: float) -> Tone | None:
    """The line near a frequency under the explanation that needs least."""
    hz, seen, counts = _tuned(pieces, near)
    tried = []
    for effect in catalogue().values():
        if not isinstance(effect, Line) or not effect.band[0] <= hz <= effect.band[1]:
            continue
        if effect.kind == "motion" and not pieces.x.oriented.all():
            continue
        tried.append(_fitted(pieces, effect, hz, seen, counts))
    if not tried:
        return None
    cost = np.log(sum(map(len, pieces.samples)))
    best = max(tried, key=lambda tone: tone.chi2 / 2 - len(tone.causes) * cost)
    if best.chi2 / 2 <= len(best.causes) * cost or not best.channels:
        return None
    return best if _share(pieces, best, seen, counts) > STEADY else None


def _share(pieces: _Pieces, tone: Tone, seen: Complex, counts: Array) -> float:
    """Part of the energy at a line's frequency that one steady line takes.

    A line keeps amplitude and phase through all windows. A hand that trembles or a base
    that is pushed has as much energy there, but another phase each time.
    """
    clear = [CHANNELS.index(name) for name in tone.channels]
    energy = (counts[:, None] / 2 * np.abs(seen[:, clear]) ** 2).sum(axis=0)
    modelled = (tone.effect.response(pieces.x, tone.hz) @ tone.causes)[:, clear]
    left = (counts[:, None] / 2 * np.abs(seen[:, clear] - modelled) ** 2).sum(axis=0)
    weight = 1 / pieces.noise[clear] ** 2
    return float(1 - (weight @ left) / (weight @ energy))


def _tuned(pieces: _Pieces, near: float) -> tuple[float, Complex, Array]:
    """Frequency refined over all windows; amplitudes (w, 6) in each, and counts."""
    shortest = min(map(len, pieces.samples)) / pieces.rate
    moments, middles, groups, counts = [], [], [], []
    for i, (samples, t) in enumerate(zip(pieces.samples, pieces.times, strict=True)):
        wave = np.conj(_wave(t, near))
        for part in np.array_split(np.arange(len(t)), 16):
            moments.append(wave[part] @ samples[part])
            middles.append(t[part].mean())
            groups.append(i)
        counts.append(len(t))
    moment, middle = np.array(moments), np.array(middles)
    span = max(np.ptp(middle), shortest)
    offsets = np.arange(-1.5 / shortest, 1.5 / shortest, 0.1 / span)
    weight = 1 / np.where(pieces.noise > 0, pieces.noise, np.inf)
    turned = np.exp(-2j * np.pi * np.outer(offsets, middle))
    apart = np.array(groups)[:, None] == np.arange(len(counts))
    energy = (np.abs(turned @ (moment * np.nan_to_num(weight))) ** 2).sum(axis=1)
    if not pieces.x.oriented.all() or len(counts) > 1:
        # what turns with the device keeps no phase in its axes: add window by window
        alone = np.einsum(
            "om,mw,mc->owc", turned, apart, moment * np.nan_to_num(weight)
        )
        energy = np.maximum(energy, (np.abs(alone) ** 2).sum(axis=(1, 2)))
    best = int(np.argmax(energy))
    wave = np.exp(-2j * np.pi * offsets[best] * middle)
    count = np.array(counts, dtype=float)
    seen = 2 / count[:, None] * (apart.T @ (moment * wave[:, None]))
    return near + float(offsets[best]), seen, count


def _fitted(
    pieces: _Pieces, effect: Line, hz: float, seen: Complex, counts: Array
) -> Tone:
    weight = np.nan_to_num(1 / pieces.noise**2)
    response = effect.response(pieces.x, hz)
    half = counts[:, None, None] / 2
    weighted = np.conj(response) * weight[:, None] * half
    normal = np.einsum("wcm,wcn->mn", weighted, response)
    normal += 1e-12 * np.trace(normal).real * np.eye(len(normal))
    causes = np.linalg.solve(normal, np.einsum("wcm,wc->m", weighted, seen))
    sigma = np.sqrt(np.diag(np.linalg.inv(normal)).real)
    left = seen - response @ causes
    chi2 = float(
        (half[:, :, 0] * weight * (np.abs(seen) ** 2 - np.abs(left) ** 2)).sum()
    )
    amplitude = np.sqrt((np.abs(response @ causes) ** 2).mean(axis=0))
    error = pieces.noise * np.sqrt(2 / counts.sum())
    clear = [
        n for n, a, e in zip(CHANNELS, amplitude, error, strict=True) if a > CLEAR * e
    ]
    spread = np.sqrt(np.mean([np.var(np.concatenate(pieces.times))]))
    values, sigmas = _named(effect, causes, sigma)
    values["hz"] = hz
    sigmas["hz"] = float(1 / (2 * np.pi * spread * np.sqrt(max(chi2, 1.0))))
    return Tone(effect, hz, causes, values, sigmas, tuple(clear), amplitude, chi2)


def _named(
    effect: Line, causes: Complex, sigma: Array
) -> tuple[dict[str, float], dict[str, float]]:
    """Amplitudes by name: one for each cause, or one for all of them."""
    names = [p.name for p in effect.params]
    if len(names) == len(causes):
        some = [i for i in range(len(names)) if abs(causes[i]) > CLEAR * sigma[i]]
        return (
            {names[i]: float(abs(causes[i])) for i in some},
            {names[i]: float(sigma[i]) for i in some},
        )
    size = float(np.linalg.norm(causes))
    share = np.abs(causes) / max(size, 1e-300)
    return {names[0]: size}, {names[0]: float(np.linalg.norm(share * sigma))}


def _without(pieces: _Pieces, tone: Tone) -> _Pieces:
    response = tone.effect.response(pieces.x, tone.hz) @ tone.causes
    left = [
        s - np.real(_wave(t, tone.hz)[:, None] * seen)
        for s, t, seen in zip(pieces.samples, pieces.times, response, strict=True)
    ]
    return replace(pieces, samples=tuple(left))
