"""Differences in samples: noise, lines in the spectrum, faults of the signal chain."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.against.joint import probability_of_difference
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.against.side import DiagnosedRecording
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.findings.sample_effects import effect_of_line
from fieldcal.diagnosis.result import FoundEffect, Mismatch, Quantity
from fieldcal.diagnosis.signal.line import tune_line
from fieldcal.diagnosis.signal.moments import moments_of
from fieldcal.diagnosis.signal.pieces import samples_of_windows
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.physics.effect import Chain, Line

NOISE_LOG_SPREAD = 0.5
"""Typical difference of the noise of two devices, ln."""

NO_NOISE_RATIO = 1e-3
"""Noise, relative to the other recording's, that counts as none."""

CERTAIN = 5.0
"""Difference of two sizes of a fault that is significant, standard deviations."""

FAINT_LINE_SIGMAS = 5.0
"""Least amplitude of a line at a frequency that the other recording has, in standard
deviations; four are exceeded by chance at one of the frequencies nearby."""

SAME_GRID = 0.01
"""Relative difference of steps or limits beyond rounding."""

WHEN = ("at_s", "from_s", "to_s", "for_s")
"""Parameters that state when something happened; they are no property of a device."""

APART_HZ = 0.5
"""Largest frequency difference of the same line, in cycles per recording."""


def noise_level(one: DiagnosedRecording, c: int) -> Quantity:
    """Noise of one channel."""
    level = float(one.noise[c])
    return Quantity(level, level * float(one.noise_uncertainty[c]), UNITS[c // 3])


def noise_differences(
    real: DiagnosedRecording, sim: DiagnosedRecording
) -> Iterator[Difference]:
    """Differences in the noise of each triad."""
    for part in (slice(0, 3), slice(3, 6)):
        seen = np.isfinite(real.noise[part]) & np.isfinite(sim.noise[part])
        at = np.flatnonzero(seen & (real.noise[part] > 0)) + part.start
        if len(at):
            yield from _triad_noise_difference(real, sim, at.tolist())


def _triad_noise_difference(
    real: DiagnosedRecording, sim: DiagnosedRecording, at: Sequence[int]
) -> Iterator[Difference]:
    """Difference of one triad, by the logarithms of its noise levels."""
    one = real.noise[at]
    two = np.maximum(sim.noise[at], NO_NOISE_RATIO * one)
    off = np.log(one / two)
    sigma = np.hypot(real.noise_uncertainty[at], sim.noise_uncertainty[at])
    probability = probability_of_difference(
        off, np.diag(sigma**2), np.full(len(at), NOISE_LOG_SPREAD)
    )
    if probability < thresholds.NAMED:
        return
    pairs = {
        CHANNELS[c]: RealAndSimulated.of(noise_level(real, c), noise_level(sim, c))
        for c in at
    }
    silent = bool((sim.noise[at] <= NO_NOISE_RATIO * one).all())
    louder = [
        c
        for c, o, s in zip(at, off, sigma, strict=True)
        if abs(o) > thresholds.STANDS_OUT * s
    ]
    where = tuple(
        _mismatch_of_channel(real, CHANNELS[c], pairs[CHANNELS[c]]) for c in louder
    )
    yield Difference(
        "noise", "left_out" if silent else "resized", probability, pairs, where=where
    )


def _mismatch_of_channel(
    one: DiagnosedRecording, channel: str, pair: RealAndSimulated
) -> Mismatch:
    """The mismatch of a channel in all samples."""
    positions = one.explanation.prepared.source.about.position_numbers or (0,)
    off = pair.difference
    size = abs(float(off.value))
    return Mismatch(
        channel=channel,
        kind="samples",
        positions=tuple(sorted(positions)),
        from_s=float(one.block.t[0]),
        to_s=float(one.block.t[-1]),
        covariate="noise",
        rms=size,
        sigma=size / off.sigma if off.sigma else np.inf,
    )


def line_and_fault_differences(
    real: DiagnosedRecording, sim: DiagnosedRecording
) -> Iterator[Difference]:
    """Differences in lines of the spectrum and in faults of samples."""
    ours, theirs = _found_in_samples(real), _found_in_samples(sim)
    length = min(float(np.ptp(s.block.t)) for s in (real, sim))
    for one in ours:
        two = next((f for f in theirs if _is_same(one, f, length)), None)
        if two is not None:
            theirs.remove(two)
        yield from _difference(one, two or _faint_line(one, sim), real)
    for two in theirs:
        for found in _difference(two, _faint_line(two, real), sim):
            yield replace(
                found,
                direction="added" if found.direction == "left_out" else "resized",
                parameters={n: _exchanged(p) for n, p in found.parameters.items()},
            )


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
        off = float(one.parameters["hz"].value) - float(two.parameters["hz"].value)
        return abs(off) < APART_HZ / length + 3 * _combined_sigma(one, two, "hz")
    words = {n for n, q in one.parameters.items() if isinstance(q.value, str)}
    return all(
        n in two.parameters and two.parameters[n].value == one.parameters[n].value
        for n in words
    )


def _combined_sigma(one: FoundEffect, two: FoundEffect, name: str) -> float:
    return math.hypot(*(f.parameters[name].sigma or 0.0 for f in (one, two)))


def _difference(
    one: FoundEffect, two: FoundEffect | None, source: DiagnosedRecording
) -> Iterator[Difference]:
    """The difference of an effect, if `two` is None or has another size."""
    pairs = {}
    for name, q in one.parameters.items():
        other = two.parameters.get(name) if two is not None else None
        word = isinstance(q.value, str)
        pairs[name] = (
            RealAndSimulated(q, other, q) if word else RealAndSimulated.of(q, other)
        )
    if two is not None and not any(_sizes_differ(n, p) for n, p in pairs.items()):
        return
    yield Difference(
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
