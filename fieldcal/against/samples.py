"""Differences in samples: noise, lines in the spectrum, faults of the signal chain."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.against.joint import differs
from fieldcal.against.result import Difference, RealAndSimulated
from fieldcal.against.side import Side
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.findings.found_effects import effect_of_line
from fieldcal.diagnosis.result import FoundEffect, Mismatch, Quantity
from fieldcal.diagnosis.signal.line import tune_line
from fieldcal.diagnosis.signal.moments import moments_of
from fieldcal.diagnosis.signal.pieces import samples_of_windows
from fieldcal.effects import catalogue
from fieldcal.model import thresholds
from fieldcal.physics.effect import Chain, Line

LOUDER = 0.5
"""Typical difference of the noise of two devices, ln."""

NONE = 1e-3
"""Noise, in that of the other recording, from which there is none to speak of."""

CERTAIN = 5.0
"""Standard deviations from which two sizes of one fault are two."""

FAINT = 5.0
"""Standard deviations of a line's amplitude from which it is one, at a frequency that
another recording has it at: of those about it one exceeds four by chance."""

SAME_GRID = 0.01
"""Part by which steps or limits differ that are not the same, rounding aside."""

WHEN = ("at_s", "from_s", "to_s", "for_s")
"""Parameters that tell when something happened, which is no property of a device."""

APART_HZ = 0.5
"""Cycles in the length of a recording by which two lines may be apart and be one."""


def level(one: Side, c: int) -> Quantity:
    """Noise of one channel."""
    level = float(one.noise[c])
    return Quantity(level, level * float(one.unsure[c]), UNITS[c // 3])


def noise(real: Side, sim: Side) -> Iterator[Difference]:
    """Triads whose outputs differ in noise."""
    for part in (slice(0, 3), slice(3, 6)):
        seen = np.isfinite(real.noise[part]) & np.isfinite(sim.noise[part])
        at = np.flatnonzero(seen & (real.noise[part] > 0)) + part.start
        if len(at):
            yield from _noise(real, sim, at.tolist())


def _noise(real: Side, sim: Side, at: Sequence[int]) -> Iterator[Difference]:
    """One triad, by the logarithms of its levels."""
    one = real.noise[at]
    two = np.maximum(sim.noise[at], NONE * one)
    off = np.log(one / two)
    sigma = np.hypot(real.unsure[at], sim.unsure[at])
    probability = differs(off, np.diag(sigma**2), np.full(len(at), LOUDER))
    if probability < thresholds.NAMED:
        return
    pairs = {
        CHANNELS[c]: RealAndSimulated.of(level(real, c), level(sim, c)) for c in at
    }
    silent = bool((sim.noise[at] <= NONE * one).all())
    louder = [
        c
        for c, o, s in zip(at, off, sigma, strict=True)
        if abs(o) > thresholds.STANDS_OUT * s
    ]
    where = tuple(_whole(real, CHANNELS[c], pairs[CHANNELS[c]]) for c in louder)
    yield Difference(
        "noise", "left_out" if silent else "resized", probability, pairs, where=where
    )


def _whole(one: Side, channel: str, pair: RealAndSimulated) -> Mismatch:
    """A mismatch of all samples of a channel."""
    positions = one.explanation.prepared.source.about.numbers or (0,)
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


def lines_and_faults(real: Side, sim: Side) -> Iterator[Difference]:
    """Effects that are found in the spectrum or on samples."""
    ours, theirs = _found(real), _found(sim)
    length = min(float(np.ptp(s.block.t)) for s in (real, sim))
    for one in ours:
        two = next((f for f in theirs if _is_same(one, f, length)), None)
        if two is not None:
            theirs.remove(two)
        yield from _difference(one, two or _faint(one, sim), real)
    for two in theirs:
        for found in _difference(two, _faint(two, real), sim):
            yield replace(
                found,
                direction="added" if found.direction == "left_out" else "resized",
                parameters={n: _turned(p) for n, p in found.parameters.items()},
            )


def _turned(pair: RealAndSimulated) -> RealAndSimulated:
    """The same with recording and simulator exchanged."""
    value = pair.difference.value
    off = value if isinstance(value, str) else -value
    return RealAndSimulated(
        pair.simulator, pair.real, replace(pair.difference, value=off)
    )


def _faint(one: FoundEffect, other: Side) -> FoundEffect | None:
    """A line that another recording shows too weakly to be found without a hint."""
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
    clear = any(float(q.value) > FAINT * (q.sigma or 0.0) for q in sizes.values())
    return found if clear and _is_near(one, found, other) else None


def _is_near(one: FoundEffect, two: FoundEffect, source: Side) -> bool:
    return _is_same(one, two, float(np.ptp(source.block.t)))


def _found(one: Side) -> list[FoundEffect]:
    return [
        f for f in one.diagnosis.effects if isinstance(catalogue()[f.id], Chain | Line)
    ]


def _is_same(one: FoundEffect, two: FoundEffect, length: float) -> bool:
    """Whether two findings are of one thing: the line, the channel, the kind."""
    if one.id != two.id:
        return False
    if "hz" in one.parameters and "hz" in two.parameters:
        off = float(one.parameters["hz"].value) - float(two.parameters["hz"].value)
        return abs(off) < APART_HZ / length + 3 * _together(one, two, "hz")
    words = {n for n, q in one.parameters.items() if isinstance(q.value, str)}
    return all(
        n in two.parameters and two.parameters[n].value == one.parameters[n].value
        for n in words
    )


def _together(one: FoundEffect, two: FoundEffect, name: str) -> float:
    return math.hypot(*(f.parameters[name].sigma or 0.0 for f in (one, two)))


def _difference(
    one: FoundEffect, two: FoundEffect | None, source: Side
) -> Iterator[Difference]:
    """What one has and the other has not, or has of another size."""
    pairs = {}
    for name, q in one.parameters.items():
        other = two.parameters.get(name) if two is not None else None
        word = isinstance(q.value, str)
        pairs[name] = (
            RealAndSimulated(q, other, q) if word else RealAndSimulated.of(q, other)
        )
    if two is not None and not any(_apart(n, p) for n, p in pairs.items()):
        return
    yield Difference(
        one.id,
        "left_out" if two is None else "resized",
        one.probability,
        pairs,
        where=tuple(_places(one, source)),
    )


def _apart(name: str, pair: RealAndSimulated) -> bool:
    off = pair.difference
    if name in WHEN or isinstance(off.value, str):
        return False
    if off.sigma:
        return abs(off.value) > CERTAIN * off.sigma
    sizes = [abs(float(q.value)) for q in (pair.real, pair.simulator) if q is not None]
    return abs(off.value) > SAME_GRID * max(sizes)


def _places(one: FoundEffect, source: Side) -> Iterator[Mismatch]:
    """Where its session shows an effect on samples: the mismatch of its kind."""
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
