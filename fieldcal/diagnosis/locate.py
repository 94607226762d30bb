"""Where recording and simulation part: channel, positions, stretch of time, covariate.

For an effect of the windows the residual without it, all else fitted, is looked at: the
channels whose squares it accounts for, the positions in which it stands out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.heldout import cells
from fieldcal.diagnosis.naming import Removed
from fieldcal.diagnosis.reduce import spans
from fieldcal.diagnosis.result import Kind, Mismatch
from fieldcal.diagnosis.unknown import Unknown, walking
from fieldcal.effects import Fault, catalogue
from fieldcal.samples import CHANNELS, Array

CLEAR = 25.0
"""Squares that a channel has to lose for the mismatch to be in it."""

PART = 0.03
"""And at least this part of the most that any channel loses."""

STANDS = 3.5
"""Standard deviations from which a position stands out."""

KINDS: Mapping[str, Kind] = {
    "temperature": "temperature",
    "rate of the temperature": "temperature",
    "temperature × force": "temperature",
    "time": "time",
    "faster time": "time",
    "fast time": "time",
    "force and time": "time",
    "time since the start": "time",
    "time since the turn": "transient",
    "since turn": "transient",
    "scatter between windows beyond white noise": "time",
    "walk": "time",
}


def of_effects(
    explanation: Explanation, lost: Mapping[str, Removed]
) -> Iterator[Mismatch]:
    """Mismatches that effects of the windows account for."""
    for name, without in lost.items():
        covariate = catalogue()[name].covariate
        kind = KINDS.get(covariate, "position")
        yield from _of_residual(
            explanation, without.fit, without.squares, kind, covariate
        )


def of_unknown(
    explanation: Explanation, found: Sequence[Unknown]
) -> Iterator[Mismatch]:
    """Mismatches that no effect in the catalogue accounts for."""
    for unknown in found:
        positions = unknown.positions
        start, end = _stretch(explanation, positions)
        yield Mismatch(
            channel=CHANNELS[unknown.channel],
            kind=KINDS.get(unknown.kind, "position"),
            positions=positions,
            from_s=start,
            to_s=end,
            covariate=unknown.covariate,
            rms=unknown.rms,
            sigma=unknown.sigma,
            correlation=unknown.correlation,
            share=unknown.share,
        )


def of_chance(explanation: Explanation) -> Iterator[Mismatch]:
    """Scatter that was found random."""
    bench = explanation.model.bench
    if bench.errors.setting > 0:
        plain = bench.but(errors=replace(bench.errors, setting=0.0))
        fit = plain.fit(explanation.fit.terms, explanation.fit)
        squares = (fit.white**2).sum(axis=0) - (explanation.fit.white**2).sum(axis=0)
        covariate = catalogue()["angle_setting"].covariate
        yield from _of_residual(explanation, fit, squares, "position", covariate)
    walks = [p.channel for p in walking(explanation) if p.kind == "walk"]
    if walks:
        plain = explanation.prepared.bench
        fit = plain.fit(explanation.fit.terms, explanation.fit)
        squares = (fit.white**2).sum(axis=0) - plain.rows.used.sum(axis=0)
        squares[[c not in walks for c in range(6)]] = 0.0
        covariate = catalogue()["random_walk"].covariate
        yield from _of_residual(explanation, fit, squares, "time", covariate)


def _of_residual(
    explanation: Explanation, fit: Fit, squares: Array, kind: Kind, covariate: str
) -> Iterator[Mismatch]:
    bench = explanation.prepared.bench
    mean, sd, position = cells(bench.rows, fit.residual)
    needed = max(CLEAR, PART * float(np.nanmax(squares)))
    for c in np.flatnonzero(squares >= min(needed, float(np.nanmax(squares)))):
        at = standing_out(mean[:, c] / sd[:, c], position)
        inside = np.isin(position, at)
        start, end = _stretch(explanation, at)
        yield Mismatch(
            channel=CHANNELS[c],
            kind=kind,
            positions=at,
            from_s=start,
            to_s=end,
            covariate=covariate,
            rms=float(np.sqrt(np.nanmean(mean[inside, c] ** 2))),
            sigma=float(np.sqrt(max(squares[c], 0.0))),
        )


def standing_out(z: Array, position: NDArray[np.intp]) -> tuple[int, ...]:
    """Positions whose residuals stand out; the largest, if none does."""
    size = np.nan_to_num(np.abs(z))
    out = np.unique(position[size > STANDS])
    if not len(out):
        out = position[[int(np.argmax(size))]]
    return tuple(int(p) for p in out)


def _stretch(explanation: Explanation, positions: Sequence[int]) -> tuple[float, float]:
    source = explanation.prepared.source
    windows = spans(source.block, source.about)[list(positions)]
    t = source.block.t
    return float(t[windows[:, 0].min()]), float(t[windows[:, 1].max() - 1])


def of_faults(
    t: Array, windows: NDArray[np.intp], faults: Sequence[tuple[str, Fault]]
) -> Iterator[Mismatch]:
    """What happened to samples."""
    for name, fault in faults:
        inside = [
            p
            for p, (a, b) in enumerate(windows)
            if b > a and t[a] <= fault.to_s and t[b - 1] >= fault.from_s
        ]
        for channel in fault.channels or (fault.channel,):
            yield Mismatch(
                channel=str(channel),
                kind="spectrum" if name == "noise_level" else "samples",
                positions=tuple(inside),
                from_s=fault.from_s,
                to_s=fault.to_s,
                covariate=catalogue()[name].covariate,
                rms=fault.size,
                sigma=fault.sigma,
            )


def of_tones(explanation: Explanation) -> Iterator[Mismatch]:
    """Lines in the spectrum."""
    held = np.unique(explanation.prepared.bench.rows.x.position)
    positions = tuple(int(p) for p in held)
    start, end = _stretch(explanation, positions)
    for tone in explanation.prepared.tones:
        for name in tone.channels:
            size = float(tone.amplitude[CHANNELS.index(name)])
            yield Mismatch(
                channel=name,
                kind="spectrum",
                positions=positions,
                from_s=start,
                to_s=end,
                covariate=f"{tone.hz:.4g} Hz",
                rms=size / np.sqrt(2),
                sigma=float(np.sqrt(tone.chi2)),
            )


def of_turns(explanation: Explanation) -> Iterator[Mismatch]:
    """Effects that the turns show."""
    table, turning = explanation.table, explanation.turning
    if table is None or turning is None:
        return
    for term in turning.terms:
        kept = tuple(t for t in turning.terms if t is not term)
        now = table.fit(turning.terms, turning.rows, 20.0)
        less = table.fit(kept, turning.rows, 20.0)
        rise = less.white**2 - now.white**2
        at = table.turn[turning.rows]
        by_turn = np.bincount(at, rise, minlength=len(explanation.made))
        out = np.flatnonzero(by_turn > max(STANDS**2, 0.05 * by_turn.max()))
        made = [explanation.made[i] for i in out]
        for channel, size in table.shown(term, turning, out).items():
            yield Mismatch(
                channel=channel,
                kind="turn",
                positions=tuple(sorted({p for t in made for p in t.positions})),
                from_s=min(float(t.t[0]) for t in made),
                to_s=max(float(t.t[-1]) for t in made),
                covariate=term.effect.covariate,
                rms=size,
                sigma=float(np.sqrt(max(rise.sum(), 0.0))),
            )
