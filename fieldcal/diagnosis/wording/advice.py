"""What to do in the field now."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.unknown_mismatch import Unknown, listed
from fieldcal.diagnosis.result import FoundEffect
from fieldcal.diagnosis.wording.deciding_position import decided_by, deciding_position
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Chain, Scatter

LESS_THAN = 3
"""Positions below which none can be held out."""


def advice(
    explanation: Explanation, effects: Sequence[FoundEffect], unknown: Sequence[Unknown]
) -> Iterator[str]:
    """Sentences, the most urgent first."""
    for one in effects:
        if isinstance(catalogue()[one.id], Chain):
            yield f"{one.id}: {decided_by(one.id)}, then diagnose again."
    yield from _deciding(explanation, effects)
    yield from dict.fromkeys(_look(mystery) for mystery in unknown)
    known = [f.id for f in effects if not f.aliases and _deterministic(f)]
    if known and not unknown:
        ids = ", ".join(f'"{i}"' for i in known)
        yield (
            f"put effects = [{ids}] with the values found into [model] of"
            " session.toml, or keep the device file that --twin writes."
        )
    if any(isinstance(catalogue()[f.id], Scatter) for f in effects):
        yield "hold more positions, or longer ones: what is random averages out."
    held = len(explanation.dictionary.held)
    if held < LESS_THAN:
        yield f"record more than {held} position{'s' * (held > 1)}: few tell little."


def _deciding(
    explanation: Explanation, effects: Sequence[FoundEffect]
) -> Iterator[str]:
    """How to tell an effect from its aliases."""
    for one in effects:
        for other in one.aliases:
            place = deciding_position(explanation, one.id, other)
            if place is None:
                yield f"to tell {one.id} from {other}: {decided_by(one.id)}."
            else:
                yield (
                    f"to tell {one.id} from {other}: record the position"
                    f" α = {place[0]:g}°, β = {place[1]:g}° as well."
                )


def _look(unknown: Unknown) -> str:
    one = unknown.mismatch
    places = listed(one.positions)
    if unknown.turned:
        return f"set {places} anew and take it again: its angles were others."
    if not np.isfinite(one.correlation):
        return f"take {places} again: {one.channel} is off there by itself."
    return (
        f"vary {unknown.cause} on purpose and hold the rest: {one.channel} follows it,"
        " and no effect in the catalogue does."
    )


def _deterministic(found: FoundEffect) -> bool:
    return not isinstance(catalogue()[found.id], Scatter | Chain)
