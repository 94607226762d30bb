"""Where recording and simulation differ: channel, positions, time, covariate.

For a cause these follow from the residual of the fit without it: the channels whose
squares the cause explains, and the positions in which it is significant.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Index
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import part_means
from fieldcal.diagnosis.findings.correlates import covariate_functions
from fieldcal.diagnosis.findings.found_effects import (
    CauseRemoval,
    shows_mainly_in_turns,
)
from fieldcal.diagnosis.findings.unknown_mismatch import single_errors
from fieldcal.diagnosis.result import Kind, Mismatch
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.model.causes.cause import Cause, Group
from fieldcal.model.posterior.probabilities import ProbableCause
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.recording import Fault


def of_cause(
    explanation: Explanation, standing: ProbableCause, lost: CauseRemoval
) -> Iterator[Mismatch]:
    """Mismatches that an effect of the catalogue accounts for."""
    effect = catalogue()[standing.name]
    if shows_mainly_in_turns(lost):
        yield from _of_turns(explanation, standing, lost)
        return
    yield from _of_residual(explanation, lost, effect.seen_in, effect.covariate)


def _of_residual(
    explanation: Explanation, lost: CauseRemoval, kind: Kind, covariate: str
) -> Iterator[Mismatch]:
    squares = lost.squares
    most = float(np.nanmax(squares))
    for c in np.flatnonzero(
        squares
        >= min(max(thresholds.IN_CHANNEL, thresholds.IN_CHANNEL_PART * most), most)
    ).tolist():
        yield _in_windows(explanation, lost, c, (), kind, covariate)


def _in_windows(
    explanation: Explanation,
    lost: CauseRemoval,
    c: int,
    positions: tuple[int, ...],
    kind: Kind,
    covariate: str,
) -> Mismatch:
    """Mismatch of one channel in windows without a cause.

    If no positions are given, they are those whose residuals stand out.
    """
    mean, sd, position = part_means(explanation.rows, lost.residual)
    at = positions or outstanding_positions(mean[:, c] / sd[:, c], position)
    start, end = time_span(explanation, at)
    inside = np.isin(position, at)
    return Mismatch(
        channel=CHANNELS[c], kind=kind, positions=at, from_s=start, to_s=end,
        covariate=covariate, rms=float(np.sqrt(np.nanmean(mean[inside, c] ** 2))),
        sigma=float(np.sqrt(max(lost.squares[c], 0.0))),
    )  # fmt: skip


def outstanding_positions(z: Array, position: Index) -> tuple[int, ...]:
    """Positions with a significant residual; that of the largest, if there is none."""
    size = np.nan_to_num(np.abs(z))
    out = np.unique(position[size > thresholds.STANDS_OUT])
    if not len(out):
        out = position[[int(np.argmax(size))]]
    return tuple(int(p) for p in out)


def time_span(
    explanation: Explanation, positions: Sequence[int]
) -> tuple[float, float]:
    """Device time from the first to the last sample of some positions, s."""
    source = explanation.source
    windows = window_bounds(source.block, source.about)[list(positions)]
    t = source.block.t
    return float(t[windows[:, 0].min()]), float(t[windows[:, 1].max() - 1])


def _of_turns(
    explanation: Explanation, standing: ProbableCause, lost: CauseRemoval
) -> Iterator[Mismatch]:
    """Mismatches that a cause makes in turns, one for each channel."""
    turned = explanation.inferred.turn_rows
    if not turned:
        return
    columns = np.concatenate([g.columns for _, g in standing.members])
    values = explanation.best.estimate
    squares = np.zeros(len(turned))
    for i, turn in enumerate(turned):
        at = np.isin(turn.columns, columns)
        off = turn.design[:, at] @ values[turn.columns[at]]
        way = turn.way_design[:, at] @ values[turn.columns[at]]
        squares[i] = float(turn.info @ off**2) + float(way @ way)
    trace = thresholds.IN_CHANNEL_PART * squares.max()
    out = squares > max(thresholds.STANDS_OUT**2, trace)
    contributing = [t for t, o in zip(turned, out, strict=True) if o] or list(turned)
    places = tuple(sorted({p for t in contributing for p in t.positions}))
    source = explanation.source
    windows = window_bounds(source.block, source.about)
    t = source.block.t
    gaps = [
        (windows[p, 1], windows[q, 0]) for p, q in (s.positions for s in contributing)
    ]
    effect = catalogue()[standing.name]
    delta = 2 * (explanation.posterior.best.state.score - lost.set.state.score)
    for channel, size in largest_turn_outputs(explanation, standing).items():
        yield Mismatch(
            channel=channel,
            kind="turn",
            positions=places,
            from_s=float(t[min(a for a, _ in gaps)]),
            to_s=float(t[max(b for _, b in gaps) - 1]),
            covariate=effect.covariate,
            rms=size,
            sigma=float(np.sqrt(max(delta, 0.0))),
        )


def largest_turn_outputs(
    explanation: Explanation, standing: ProbableCause
) -> dict[str, float]:
    """Largest output that a cause makes in turns, by channel, rms of the worst turn."""
    fit = explanation.inferred.fit
    out: dict[str, float] = {}
    state, members = explanation.state, standing.members
    for course in fit.outputs_in_turns(explanation.turns, state, members):
        for c, name in enumerate(CHANNELS):
            size = float(np.sqrt(np.mean(course[:, c] ** 2)))
            out[name] = max(out.get(name, 0.0), size)
    for triad in (CHANNELS[:3], CHANNELS[3:]):
        largest = max((out.get(n, 0.0) for n in triad), default=0.0)
        for name in triad:
            trace = thresholds.IN_OUTPUT_PART * largest
            if out.get(name, 0.0) <= trace or largest <= 0.0:
                out.pop(name, None)
    return out


def of_unknown(
    explanation: Explanation, standing: ProbableCause, lost: CauseRemoval
) -> Iterator[Mismatch]:
    """Mismatches that no effect in the catalogue accounts for."""
    for member in standing.members:
        for group in single_errors(explanation, member):
            yield from _of_group(explanation, member[0], group, lost)


def _of_group(
    explanation: Explanation, cause: Cause, group: Group, lost: CauseRemoval
) -> Iterator[Mismatch]:
    """Mismatches that a group accounts for, on its channels, in its positions."""
    positions = (group.position,) if group.position >= 0 else group.moved_positions
    triad = np.arange(3, 6) if group.part == "gyr" else np.arange(3)
    squares = np.nan_to_num(lost.squares[triad])
    channels = (
        [CHANNELS.index(group.part)]
        if group.part in CHANNELS
        else triad[squares > thresholds.IN_CHANNEL].tolist()
        or [int(triad[squares.argmax()])]
    )
    for c in channels:
        kind = KINDS.get(cause.name, "position")
        covariate, correlation, share = best_correlate(
            explanation, cause, c, lost.residual
        )
        mismatch = _in_windows(explanation, lost, c, positions, kind, covariate)
        yield replace(mismatch, correlation=correlation, share=share)


KINDS: dict[str, Kind] = {
    "time": "time",
    "force and time": "time",
    "temperature": "temperature",
    "since turn": "transient",
}
"""Kind of mismatch of functions that no effect makes; the others go by position."""


def best_correlate(
    explanation: Explanation, cause: Cause, channel: int, residual: Array
) -> tuple[str, float, float]:
    """Covariate of an unexplained residual, its correlation, and the share of variance.

    Correlation and share are nan where the cause belongs to single positions.
    """
    name = cause.name
    if cause.by_window:
        return "the position itself", np.nan, np.nan
    x, off = explanation.rows.x, residual[:, channel]
    known = np.isfinite(off)
    best, correlation = name, np.nan
    for label, course in covariate_functions(name, x, channel).items():
        spread = course[known].std()
        if spread > 1e-9:
            coefficient = float(np.corrcoef(course[known], off[known])[0, 1])
            if not np.isfinite(correlation) or abs(coefficient) > abs(correlation):
                best, correlation = label, coefficient
    after = explanation.best.residual()[:, channel]
    sd = explanation.rows.sd[:, channel]
    noise = float(known.sum())
    total = float(((off / sd)[known] ** 2).sum()) - noise
    left = float(((after / sd)[known] ** 2).sum()) - noise
    return best, correlation, float(np.clip(1 - left / max(total, 1e-9), 0.0, 1.0))


def of_faults(
    t: Array, windows: Index, faults: Sequence[tuple[str, Fault]]
) -> Iterator[Mismatch]:
    """Mismatches by faults of samples."""
    for name, fault in faults:
        inside = [
            p
            for p, (a, b) in enumerate(windows)
            if b > a and t[a] <= fault.to_s and t[b - 1] >= fault.from_s
        ]
        effect = catalogue()[name]
        for channel in fault.channels or (fault.channel,):
            yield Mismatch(
                channel=str(channel),
                kind=effect.seen_in,
                positions=tuple(inside),
                from_s=fault.from_s,
                to_s=fault.to_s,
                covariate=effect.covariate,
                rms=fault.size,
                sigma=fault.sigma,
            )


def of_tones(explanation: Explanation) -> Iterator[Mismatch]:
    """Mismatches by lines in the spectrum."""
    positions = tuple(int(p) for p in explanation.dictionary.window_positions)
    start, end = time_span(explanation, positions)
    for tone in explanation.prepared.spectral_lines:
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
