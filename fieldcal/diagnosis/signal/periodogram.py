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

from fieldcal.core.frames import turn
from fieldcal.core.samples import Array
from fieldcal.model import thresholds
from fieldcal.model.rows.reduce import Rows, RowSource, rate_of, spans
from fieldcal.physics.experience import Experience
from fieldcal.physics.recording import medians

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


NEAR = 2.0
"""Distance between two lines, in cycles of the shortest window."""

LOOKS = 10
"""Spectra looked at."""

TRIADS = ((0, 1, 2), (3, 4, 5), (0, 1, 2, 3, 4, 5))
"""Channels of one phase that are looked at together."""

AT_ONCE = 1 << 16
"""Samples that a line is taken out of at once."""

SHORTEST = 64
"""Samples of a window from which it is looked at."""

COHERENT = 1 << 18
"""Samples up to which windows are put together with one phase."""


GRID = 1 << 20
"""Periods from the first sample to the last up to which that is done: over longer
pauses no clock keeps the phase of a line."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Samples of each window about their mean, and where the device was in it."""

    x: Experience
    samples: tuple[Array, ...]
    times: tuple[Array, ...]
    noise: Array
    rate: float


def held_in(source: RowSource, rows: Rows) -> list[tuple[int, int, int]]:
    """Windows that are long enough: the first of their rows, and their bounds."""
    first = {int(p): i for i, p in reversed(list(enumerate(rows.x.position)))}
    bounds = enumerate(spans(source.block, source.about))
    return [
        (first[p], int(a), int(b))
        for p, (a, b) in bounds
        if b - a >= SHORTEST and p in first
    ]


def pieces_of(source: RowSource, rows: Rows) -> Pieces:
    """Windows of a recording that are long enough.

    Outputs of which rows say nothing, as of gravity on a table that turns, are zero.
    """
    block, held = source.block, held_in(source, rows)
    times = tuple(block.t[a:b] for _, a, b in held)
    samples = []
    for (row, a, b), t in zip(held, times, strict=True):
        usable = source.usable[a:b] & rows.used[row]
        samples.append(_flat(t, block.acc[a:b], block.gyr[a:b], usable))
    x = places_of(rows, held)
    return Pieces(x, tuple(samples), times, rows.noise, rate_of(block))


def places_of(rows: Rows, held: Sequence[tuple[int, int, int]]) -> Experience:
    """Where the device is in windows that `held_in` gives."""
    x, some = rows.x, np.array([row for row, _, _ in held], dtype=np.intp)
    return Experience.at_rest(
        x.alpha[some], x.beta[some], x.gravity, f=x.f[some], mounting=x.mounting
    )


def _flat(t: Array, acc: Array, gyr: Array, usable: NDArray[np.bool_]) -> Array:
    """Samples without mean and slope, (n, 6); zero where not usable."""
    s = (t - t.mean()) / max(np.ptp(t), 1e-9)
    out = np.empty((len(t), 6))
    for c in range(6):
        values = (acc if c < 3 else gyr)[:, c % 3]
        known = usable[:, c] & np.isfinite(values)
        column = np.where(known, values, 0.0)
        column -= column.sum() / max(int(known.sum()), 1)
        column *= known
        slope = (s @ column) / max(float((s * s) @ known), 1e-12)
        column -= slope * s
        column *= known
        out[:, c] = column
    return out


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Power of all channels.

    Attributes
    ----------
    power : (6, m)
    count : periodograms summed in it
    hz : (m,)
    together : channels in whose sums a line may stand out

    """

    power: Array
    count: int
    hz: Array
    together: tuple[tuple[int, ...], ...]


def highest(
    pieces: Pieces, spectra: Sequence[Spectrum], taken: Sequence[float]
) -> float | None:
    """Frequency of the line that stands out most, None if none does.

    Near one that is taken already, what is left belongs to it.
    """
    shortest = min(LONGEST, min(map(len, pieces.samples))) / pieces.rate
    low = max(0.05, CYCLES / shortest)
    best, near = np.log(thresholds.LINE_BY_CHANCE), None
    for spectrum in spectra:
        hz, count = spectrum.hz, spectrum.count
        band = hz >= low
        for other in taken:
            band &= np.abs(hz - other) > NEAR / shortest
        if band.sum() < 4 * BESIDE:
            continue
        stands = {}
        for c in sorted({c for some in spectrum.together for c in some}):
            power = spectrum.power[c, band]
            # median of Gamma(W) over its mean, by Wilson and Hilferty
            level = _floor(power) / (1 - 1 / (9 * count)) ** 3
            stands[c] = power / _on_a_slope(power, level) * count
        for some in spectrum.together:
            total = np.sum([stands[c] for c in some], axis=0)
            at = int(np.argmax(total))
            odds = _beyond(float(total[at]), count * len(some))
            odds += np.log(LOOKS * len(total))
            if odds < best:
                best, near = odds, float(hz[band][at])
    return near


def spectra_of(pieces: Pieces) -> list[Spectrum]:
    """Spectra in which a line may stand out.

    Channel by channel window by window; and triads with one phase throughout, in
    the device's axes and, where the angles are known, in the base's. Windows are
    tapered: what settles at the start of each is no line, though it comes as often.
    """
    power, count, hz = _power(pieces)
    used = np.flatnonzero(power.any(axis=1)).tolist()
    out = [Spectrum(power, count, hz, tuple((c,) for c in used))]
    lasts = pieces.times[-1][-1] - pieces.times[0][0]
    long = lasts * pieces.rate > GRID
    if long or sum(map(len, pieces.samples)) > COHERENT:
        return out
    frames = [np.broadcast_to(np.eye(3), (len(pieces.samples), 3, 3))]
    if pieces.x.oriented.all():
        turned = turn(pieces.x.alpha, pieces.x.beta)
        frames.append(np.moveaxis(pieces.x.mounting.T @ turned, 1, 2))
    triads = [some for some in TRIADS if set(some) <= set(used)]
    out += [Spectrum(*_one_phase(pieces, frame), tuple(triads)) for frame in frames]
    return out


def _one_phase(pieces: Pieces, frame: Array) -> tuple[Array, int, Array]:
    """Of the whole recording, with windows turned into a frame, as in `Spectrum`."""
    start, end = pieces.times[0][0], pieces.times[-1][-1]
    whole = np.zeros((6, int(round((end - start) * pieces.rate)) + 1))
    for samples, t, to_frame in zip(pieces.samples, pieces.times, frame, strict=True):
        at = np.round((t - start) * pieces.rate).astype(np.intp)
        tapered = (np.hanning(len(t))[:, None] * samples).T
        whole[:3, at], whole[3:, at] = to_frame @ tapered[:3], to_frame @ tapered[3:]
    n = 2 << (whole.shape[1] - 1).bit_length()
    return _square(np.fft.rfft(whole, n)), 1, np.fft.rfftfreq(n, 1 / pieces.rate)


def _power(pieces: Pieces) -> tuple[Array, int, Array]:
    """Of all channels, window by window, as in `Spectrum`."""
    length = min(LONGEST, max(map(len, pieces.samples)))
    n = 1 << (length - 1).bit_length()
    total, count = np.zeros((6, n // 2 + 1)), 0
    for samples in pieces.samples:
        parts = max(1, len(samples) // LONGEST)
        for part in np.array_split(samples, parts):
            taper = np.hanning(len(part))
            total += _square(np.fft.rfft(part.T * taper, n)) / (taper @ taper)
            count += 1
    return total, count, np.fft.rfftfreq(n, 1 / pieces.rate)


def _square(spectrum: Complex) -> Array:
    square: Array = spectrum.real**2 + spectrum.imag**2
    return square


def _floor(power: Array) -> Array:
    """Running median, by stretches."""
    parts = max(1, len(power) // (2 * BESIDE))
    each = len(power) // parts
    level = medians(power[: parts * each].reshape(parts, each))
    middle = (np.arange(parts) + 0.5) * each
    floor: Array = np.interp(np.arange(len(power)), middle, level)
    return np.maximum(floor, 1e-300)


def _on_a_slope(power: Array, floor: Array) -> Array:
    """The floor, or what lies close to either side where that is far above it.

    What settles or drifts has the more power the lower the frequency; a line stands out
    of that, too.
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


def line_of(t: Array, hz: float, amplitude: Complex) -> Array:
    """Line of some complex amplitudes, Re(amplitude exp(2 pi i hz t)), (n, c)."""
    turned = 2 * np.pi * hz * t
    both = np.array([amplitude.real, -amplitude.imag])
    line: Array = np.column_stack([np.cos(turned), np.sin(turned)]) @ both
    return line


def take_out(values: Array, t: Array, hz: float, amplitude: Complex) -> None:
    """Take a line out of samples, (n, c), in place."""
    for some in stretches(0, len(t)):
        values[some] -= line_of(t[some], hz, amplitude)


def stretches(first: int, last: int) -> Iterator[slice]:
    """Samples a part at a time: what is made of them takes memory, too."""
    for start in range(first, last, AT_ONCE):
        yield slice(start, min(start + AT_ONCE, last))
