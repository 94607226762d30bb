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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.reduce import Rows, Source, rate_of, spans
from fieldcal.effects import Experience, Line, catalogue
from fieldcal.frames import turn
from fieldcal.samples import CHANNELS, Array, Block

Complex = NDArray[np.complexfloating]

LONGEST = 32_768
"""Samples of one periodogram."""

CYCLES = 2.5
"""Fewest cycles in a window that make a line."""

BESIDE = 40
"""Neighbours that give the floor, to either side."""

ODDS = 1e-5
"""Of a line where there is none, over all frequencies and channels."""

NEAR = 2.0
"""Distance between two lines, in cycles of the shortest window."""

STEADY = 0.5
"""Part of the energy that one amplitude and phase must take to be a line."""

EXTRA = 6.9
"""Of ln 1000: what a line has to be worth beyond the frequencies tried."""

LOOKS = 10
"""Spectra looked at."""

COHERENT = 1 << 18
"""Samples up to which windows are put together with one phase."""

PARTS = 16
MOST = 4
SHOWS = 4.0
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
    gain : rise of ln Z, for a prior as wide as the causes are large

    """

    effect: Line
    hz: float
    causes: Complex
    values: dict[str, float]
    sigmas: dict[str, float]
    channels: tuple[str, ...]
    amplitude: Array
    chi2: float
    gain: float


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
            level = _floor(channel) / count / (1 - 1 / (9 * count)) ** 3
            stands += channel / level
        degrees = count * power.shape[1]
        at = int(np.argmax(stands))
        odds = _beyond(float(stands[at]), degrees) + np.log(LOOKS * len(stands))
        if odds < best:
            best, near = odds, float(hz[band][at])
    return near


def _spectra(pieces: _Pieces) -> Iterator[tuple[Array, int, Array]]:
    """Power of one or more channels, periodograms summed in it, and frequencies, Hz.

    Channel by channel window by window; and triads with one phase throughout, in
    the device's axes and, where the angles are known, in the base's. Windows are
    tapered: what settles at the start of each is no line, though it comes as often.
    """
    power, count, hz = _power(pieces)
    used = np.flatnonzero(power.any(axis=0))
    for c in used:
        yield power[:, [c]], count, hz
    if sum(map(len, pieces.samples)) > COHERENT or len(pieces.samples) < 2:
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


def _one_phase(pieces: _Pieces, frame: Array) -> tuple[Array, Array]:
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
    parts = max(1, len(power) // (2 * BESIDE))
    each = len(power) // parts
    level = np.median(power[: parts * each].reshape(parts, each), axis=1)
    middle = (np.arange(parts) + 0.5) * each
    floor: Array = np.interp(np.arange(len(power)), middle, level)
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
    moments = _moments(pieces, near)
    tried = []
    for effect in catalogue().values():
        if not isinstance(effect, Line) or not effect.band[0] <= near <= effect.band[1]:
            continue
        if effect.kind == "motion" and not pieces.x.oriented.all():
            continue
        tried.append(_tuned(pieces, effect, near, moments))
    if not tried:
        return None
    best = max(tried, key=lambda tone: tone.gain)
    places = np.log(sum(map(len, pieces.samples)))
    if best.gain <= places + EXTRA or not best.channels:
        return None
    return best if _share(pieces, best, moments) > STEADY else None


def _share(pieces: _Pieces, tone: Tone, moments: _Moments) -> float:
    """Part of the energy at a line's frequency that one steady line takes.

    A line keeps amplitude and phase through all windows. A hand that trembles or a base
    that is pushed has as much energy there, but another phase each time.
    """
    clear = [CHANNELS.index(name) for name in tone.channels]
    seen, half = moments.seen(tone.hz - moments.near), moments.counts[:, None] / 2
    modelled = tone.effect.response(pieces.x, tone.hz) @ tone.causes
    energy = (half * np.abs(seen[:, clear]) ** 2).sum(axis=0)
    left = (half * np.abs((seen - modelled)[:, clear]) ** 2).sum(axis=0)
    weight = 1 / pieces.noise[clear] ** 2
    noise = 2.0 * len(half) * len(clear)
    return float(1 - (weight @ left - noise) / max(weight @ energy - noise, 1e-9))


@dataclass(frozen=True, slots=True)
class _Moments:
    """Sums of the samples times a wave of frequency `near`, over parts of windows."""

    near: float
    sums: Complex
    middle: Array
    apart: Array
    counts: Array

    def seen(self, offset: float) -> Complex:
        """Amplitudes (w, 6) in each window at a frequency a little off."""
        turned = self.sums * np.exp(-2j * np.pi * offset * self.middle)[:, None]
        amplitude: Complex = 2 / self.counts[:, None] * (self.apart.T @ turned)
        return amplitude


def _moments(pieces: _Pieces, near: float) -> _Moments:
    sums, middle, groups = [], [], []
    for i, (samples, t) in enumerate(zip(pieces.samples, pieces.times, strict=True)):
        wave = np.conj(_wave(t, near))
        for part in np.array_split(np.arange(len(t)), PARTS):
            sums.append(wave[part] @ samples[part])
            middle.append(t[part].mean())
            groups.append(i)
    apart = np.equal.outer(groups, np.arange(len(pieces.samples))).astype(float)
    counts = np.array([len(s) for s in pieces.samples], dtype=float)
    return _Moments(near, np.array(sums), np.array(middle), apart, counts)


def _tuned(pieces: _Pieces, effect: Line, near: float, moments: _Moments) -> Tone:
    """The effect at the frequency, near the one given, at which it takes most."""
    shortest = min(map(len, pieces.samples)) / pieces.rate
    span = max(float(np.ptp(moments.middle)), shortest)
    step = 0.2 / span
    offsets = np.arange(-1.5 / shortest, 1.5 / shortest + step, step)
    for _ in range(3):
        tones = [
            _fitted(pieces, effect, near + o, moments.seen(o), moments.counts)
            for o in offsets
        ]
        at = int(np.argmax([tone.chi2 for tone in tones]))
        offsets = offsets[at] + np.linspace(-step, step, 11)
        step /= 5
    return tones[at]


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
    if effect.kind == "sensor":  # outputs of their own: those without it have none
        causes = np.where(np.abs(causes) > SHOWS * sigma, causes, 0.0)
    left = seen - response @ causes
    fallen = half[:, :, 0] * weight * (np.abs(seen) ** 2 - np.abs(left) ** 2)
    chi2 = float(fallen.sum())
    strength = np.abs(causes / sigma) ** 2
    amplitude = np.sqrt((np.abs(response @ causes) ** 2).mean(axis=0))
    error = pieces.noise * np.sqrt(2 / counts.sum())
    clear = [
        c for c, a, e in zip(CHANNELS, amplitude, error, strict=True) if a > SHOWS * e
    ]
    values, sigmas = _named(effect, causes, sigma)
    values["hz"] = float(hz)
    spread = float(np.concatenate(pieces.times).std())
    sigmas["hz"] = float(1 / (2 * np.pi * spread * np.sqrt(max(chi2, 1.0))))
    return Tone(
        effect,
        float(hz),
        causes,
        values,
        sigmas,
        tuple(clear),
        amplitude,
        chi2,
        chi2 / 2 - float(np.log1p(strength / 2).sum()),
    )


def _named(
    effect: Line, causes: Complex, sigma: Array
) -> tuple[dict[str, float], dict[str, float]]:
    """Amplitudes by name: one for each cause, or one for all of them."""
    names = [p.name for p in effect.params]
    if len(names) == len(causes):
        some = np.flatnonzero(causes)
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
