"""Lines in the spectrum of the outputs at rest.

A line found (`periodogram`) is fitted to the samples of all windows, one phase
throughout: as any amplitude in each output, or as what a `Line` effect makes of few
causes. With E the squares it takes, the frequency is known to
1 / (2 pi std(t) sqrt(E)). Source: D. Rife, R. Boorstyn, Single-tone parameter
estimation, 1974.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.periodogram import (
    Complex,
    Pieces,
    highest,
    pieces_of,
    wave_of,
)
from fieldcal.diagnosis.reduce import Rows, Source
from fieldcal.effects import Line, catalogue
from fieldcal.samples import CHANNELS, Array, Block

STEADY = 0.65
"""Part of the energy that one amplitude and phase must take to be a line."""

LASTS, CHANCE = 0.2, 3.0
"""Part of it in either half of the windows at least, but for so many sigmas."""

EXTRA = 6.9
"""Of ln 1000: what a line has to be worth beyond the frequencies tried."""

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


def tones(source: Source, rows: Rows) -> list[Tone]:
    """Lines in a recording, the strongest first."""
    pieces = pieces_of(source, rows)
    found: list[Tone] = []
    while pieces.samples and len(found) < MOST:
        near = highest(pieces, [tone.hz for tone in found])
        tone = _explained(pieces, near) if near is not None else None
        if tone is None:
            break
        found.append(tone)
        pieces = _without(pieces, tone)
    return found


def without(block: Block, source: Source, rows: Rows, found: Sequence[Tone]) -> Block:
    """The samples less the lines: of all windows, and on the way what sensors add."""
    six = block.six
    where = pieces_of(source, rows)
    for tone in found:
        response = tone.effect.response(where.x, tone.hz) @ tone.causes
        if tone.effect.kind == "sensor":
            six -= np.real(wave_of(block.t, tone.hz)[:, None] * response[0])
            continue
        for seen, t in zip(response, where.times, strict=True):
            at = np.searchsorted(block.t, t)
            six[at] -= np.real(wave_of(t, tone.hz)[:, None] * seen)
    return replace(block, acc=six[:, :3], gyr=six[:, 3:])


def _explained(pieces: Pieces, near: float) -> Tone | None:
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
    steady = _share(pieces, best, moments) > STEADY and _lasts(pieces, best)
    return best if steady else None


def _lasts(pieces: Pieces, tone: Tone) -> bool:
    """Whether a line takes of the squares in either half of the windows.

    What fades after turns has lines, too, where positions follow one another evenly.
    """
    clear = [CHANNELS.index(name) for name in tone.channels]
    seen = tone.effect.response(pieces.x, tone.hz) @ tone.causes
    taken = np.zeros(2)
    for s, t, one in zip(pieces.samples, pieces.times, seen, strict=True):
        line = np.real(wave_of(t, tone.hz)[:, None] * one)
        fallen = (((2 * s - line) * line / pieces.noise**2)[:, clear]).sum(axis=1)
        taken += [part.sum() for part in np.array_split(fallen, 2)]
    # half of E varies by 2 sqrt(E / 2)
    chance = CHANCE * 2 * np.sqrt(max(float(taken.sum()), 0.0) / 2)
    return bool(taken.min() + chance > LASTS * taken.sum())


def _share(pieces: Pieces, tone: Tone, moments: _Moments) -> float:
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


def _moments(pieces: Pieces, near: float) -> _Moments:
    sums, middle, groups = [], [], []
    for i, (samples, t) in enumerate(zip(pieces.samples, pieces.times, strict=True)):
        wave = np.conj(wave_of(t, near))
        for part in np.array_split(np.arange(len(t)), PARTS):
            sums.append(wave[part] @ samples[part])
            middle.append(t[part].mean())
            groups.append(i)
    apart = np.equal.outer(groups, np.arange(len(pieces.samples))).astype(float)
    counts = np.array([len(s) for s in pieces.samples], dtype=float)
    return _Moments(near, np.array(sums), np.array(middle), apart, counts)


def _tuned(pieces: Pieces, effect: Line, near: float, moments: _Moments) -> Tone:
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
    pieces: Pieces, effect: Line, hz: float, seen: Complex, counts: Array
) -> Tone:
    heard = (
        np.nan_to_num(pieces.noise) > 0
    )  # a channel that never changes tells nothing
    weight = np.where(heard, 1 / np.where(heard, pieces.noise, 1.0) ** 2, 0.0)
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


def _without(pieces: Pieces, tone: Tone) -> Pieces:
    response = tone.effect.response(pieces.x, tone.hz) @ tone.causes
    left = [
        s - np.real(wave_of(t, tone.hz)[:, None] * seen)
        for s, t, seen in zip(pieces.samples, pieces.times, response, strict=True)
    ]
    return replace(pieces, samples=tuple(left))
