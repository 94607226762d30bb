"""Differences in lines of the spectrum and in faults of the signal chain.

A line that both recordings have can rise above the noise of a channel in one of them
only. There, its amplitude is measured in the other too: it is not taken for zero. So is
a touch that only one shows no difference if the other has a slip or a jump at that
instant: both are parts of one event. A line at the frequency of one of another name is
told by that name: a base that sways by little is a hum, where its force is below noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.against.side import DiagnosedRecording
from fieldcal.diagnosis.findings.sample_effects import effect_of_line
from fieldcal.diagnosis.result import FoundEffect, Mismatch, Quantity
from fieldcal.diagnosis.signal.line import measured_amplitudes, tune_line
from fieldcal.diagnosis.signal.moments import moments_of
from fieldcal.diagnosis.signal.pieces import samples_of_windows
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Chain, Line

CERTAIN = 5.0
"""Difference of two sizes of a fault that is significant, standard deviations."""

FAINT_LINE_SIGMAS = 5.0
"""Least amplitude of a line at a frequency that the other recording has, in standard
deviations; four are exceeded by chance at one of the frequencies nearby."""

SAME_GRID = 0.01
"""Relative difference of steps or limits beyond rounding."""

WHEN = ("at_s", "from_s", "to_s", "for_s")
"""Parameters that state when something happened; they are no property of a device."""

EVENT_SIGMAS = 3.0
"""Deviation of an instant of the same event, standard deviations."""

APART_HZ = 0.5
"""Largest frequency difference of the same line, in cycles per recording."""


def compare_lines_and_faults(
    real: DiagnosedRecording, sim: DiagnosedRecording
) -> tuple[list[Difference], tuple[str, ...]]:
    """Compare lines of the spectrum and faults of samples.

    Returns
    -------
    differences, alike : what differs, and the ids of what both have with the same size

    """
    theirs = _found_in_samples(sim)
    length = min(float(np.ptp(s.block.t)) for s in (real, sim))
    ours = [_as_named_by(f, theirs, real, length) for f in _found_in_samples(real)]
    apart: list[Difference] = []
    alike: list[str] = []
    for one in ours:
        two = next((f for f in theirs if _is_same(one, f, length)), None)
        if two is not None:
            theirs.remove(two)
        elif _is_of_event(one, real, sim):
            continue
        found = _line_or_fault(one, two or _faint_line(one, sim), real, sim)
        apart += [found] if found else []
        alike += [] if found else [one.id]
    for two in theirs:
        if _is_of_event(two, sim, real):
            continue
        found = _line_or_fault(two, _faint_line(two, real), sim, real)
        apart += [_seen_from_recording(found)] if found else []
        alike += [] if found else [two.id]
    differing = {d.id for d in apart}
    return apart, tuple(dict.fromkeys(n for n in alike if n not in differing))


def _as_named_by(
    one: FoundEffect,
    others: Sequence[FoundEffect],
    source: DiagnosedRecording,
    length: float,
) -> FoundEffect:
    """A line of `source` as the one that `others` have at its frequency, if any."""
    if any(_is_same(one, other, length) for other in others):
        return one
    named = next((f for f in others if _same_frequency(one, f, length)), None)
    if named is None:
        return one
    effect, prepared = catalogue()[named.id], source.explanation.prepared
    if not isinstance(effect, Line):
        return one
    # lines that were found are no longer in the samples that rows are made of
    whole = replace(prepared.source, block=prepared.checked.block)
    pieces = samples_of_windows(whole, source.explanation.rows)
    if not pieces.samples:
        return one
    hz = one.parameters["hz"]
    values, sigmas = measured_amplitudes(pieces, effect, float(hz.value))
    sizes = {
        n: Quantity(values[n], sigmas[n], q.unit)
        for n, q in named.parameters.items()
        if n in values
    }
    return replace(one, id=named.id, parameters={**sizes, "hz": hz})


def _same_frequency(one: FoundEffect, two: FoundEffect, length: float) -> bool:
    """Whether both are lines, at one frequency."""
    if "hz" not in one.parameters or "hz" not in two.parameters:
        return False
    off = float(one.parameters["hz"].value) - float(two.parameters["hz"].value)
    return abs(off) < APART_HZ / length + 3 * _combined_sigma(one, two, "hz")


def _is_of_event(
    one: FoundEffect, source: DiagnosedRecording, other: DiagnosedRecording
) -> bool:
    """Whether an effect of `source` is but an event that `other` has at its instant.

    A slip turns the device: the samples of that turn are found as a bump, or are not.
    """
    if "at_s" not in one.parameters or not one.parameters.keys() <= set(WHEN):
        return False
    first, length = (
        float(one.parameters[n].value) if n in one.parameters else 0.0
        for n in ("at_s", "for_s")
    )
    later = other.start - source.start
    for effect in other.diagnosis.effects:
        if at := effect.parameters.get("at_s"):
            off = float(at.value) - later - first
            unsure = EVENT_SIGMAS * (at.sigma or 0.0)
            if -unsure < off < length + unsure:
                return True
    return False


def _seen_from_recording(found: Difference) -> Difference:
    """A difference found from the simulator's side."""
    return replace(
        found,
        direction="added" if found.direction == "left_out" else "resized",
        parameters={n: _exchanged(p) for n, p in found.parameters.items()},
    )


def _line_or_fault(
    one: FoundEffect,
    two: FoundEffect | None,
    source: DiagnosedRecording,
    other: DiagnosedRecording,
) -> Difference | None:
    """The difference of an effect of `source` from that of `other`, if there is one.

    A line that both have may be above the noise of a channel in one of them only.
    """
    if two is not None:
        one, two = _measured_too(one, two, source), _measured_too(two, one, other)
    return _difference(one, two, source)


def _measured_too(
    one: FoundEffect, as_in: FoundEffect, source: DiagnosedRecording
) -> FoundEffect:
    """A line with the amplitudes, though within its noise, that another has."""
    effect, missing = catalogue()[one.id], as_in.parameters.keys() - one.parameters
    if not isinstance(effect, Line) or not missing:
        return one
    explanation = source.explanation
    pieces = samples_of_windows(explanation.prepared.source, explanation.rows)
    if not pieces.samples:
        return one
    hz = float(one.parameters["hz"].value)
    values, sigmas = measured_amplitudes(pieces, effect, hz)
    more = {
        n: Quantity(values[n], sigmas[n], as_in.parameters[n].unit)
        for n in as_in.parameters
        if n in missing and n in values
    }
    return replace(one, parameters={**one.parameters, **more})


def _exchanged(pair: RealAndSimulated) -> RealAndSimulated:
    """The pair with recording and simulator exchanged."""
    value = pair.difference.value
    off = value if isinstance(value, str) else -value
    return RealAndSimulated(
        pair.simulator, pair.real, replace(pair.difference, value=off)
    )


def _faint_line(one: FoundEffect, other: DiagnosedRecording) -> FoundEffect | None:
    """The same line in the other recording, if it is too weak to be found by search."""
    effect = catalogue()[one.id]
    if not isinstance(effect, Line):
        return None
    source, rows = other.explanation.prepared.source, other.explanation.rows
    pieces = samples_of_windows(source, rows)
    if not pieces.samples:
        return None
    hz = float(one.parameters["hz"].value)
    found = effect_of_line(tune_line(pieces, effect, moments_of(pieces, hz)), np.nan)
    sizes = {n: q for n, q in found.parameters.items() if n != "hz"}
    clear = any(
        float(q.value) > FAINT_LINE_SIGMAS * (q.sigma or 0.0) for q in sizes.values()
    )
    return found if clear and _is_near(one, found, other) else None


def _is_near(one: FoundEffect, two: FoundEffect, source: DiagnosedRecording) -> bool:
    return _is_same(one, two, float(np.ptp(source.block.t)))


def _found_in_samples(one: DiagnosedRecording) -> list[FoundEffect]:
    return [
        f for f in one.diagnosis.effects if isinstance(catalogue()[f.id], Chain | Line)
    ]


def _is_same(one: FoundEffect, two: FoundEffect, length: float) -> bool:
    """Whether two effects are the same: the same line, or the same channel and kind."""
    if one.id != two.id:
        return False
    if "hz" in one.parameters and "hz" in two.parameters:
        return _same_frequency(one, two, length)
    words = {n for n, q in one.parameters.items() if isinstance(q.value, str)}
    return all(
        n in two.parameters and two.parameters[n].value == one.parameters[n].value
        for n in words
    )


def _combined_sigma(one: FoundEffect, two: FoundEffect, name: str) -> float:
    return math.hypot(*(f.parameters[name].sigma or 0.0 for f in (one, two)))


def _difference(
    one: FoundEffect, two: FoundEffect | None, source: DiagnosedRecording
) -> Difference | None:
    """The difference of an effect, if `two` is None or has another size."""
    pairs = {}
    for name, q in one.parameters.items():
        other = two.parameters.get(name) if two is not None else None
        word = isinstance(q.value, str)
        pairs[name] = (
            RealAndSimulated(q, other, q) if word else RealAndSimulated.of(q, other)
        )
    if two is not None and not any(_sizes_differ(n, p) for n, p in pairs.items()):
        return None
    return Difference(
        one.id,
        "left_out" if two is None else "resized",
        one.probability,
        pairs,
        where=tuple(_mismatches_of_effect(one, source)),
    )


def _sizes_differ(name: str, pair: RealAndSimulated) -> bool:
    off = pair.difference
    if name in WHEN or isinstance(off.value, str):
        return False
    if off.sigma:
        return abs(off.value) > CERTAIN * off.sigma
    sizes = [abs(float(q.value)) for q in (pair.real, pair.simulator) if q is not None]
    return abs(off.value) > SAME_GRID * max(sizes)


def _mismatches_of_effect(
    one: FoundEffect, source: DiagnosedRecording
) -> Iterator[Mismatch]:
    """Mismatches of an effect in its session."""
    effect = catalogue()[one.id]
    hz = one.parameters.get("hz")
    for m in source.diagnosis.mismatch:
        line = hz is not None and m.kind == "spectrum"
        if (line or m.kind == effect.seen_in) and m.covariate in _covariates(one):
            yield m


def _covariates(one: FoundEffect) -> set[str]:
    effect, hz = catalogue()[one.id], one.parameters.get("hz")
    out = {effect.covariate, one.id}
    return out | ({f"{hz.value:.4g} Hz"} if hz is not None else set())
