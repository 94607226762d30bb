"""Instabilities at which causes are offered to a set."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import CLOSURE
from fieldcal.model.evidence.sizing import UNIT_INDEX

InstabilityIndices = tuple[int, ...]
"""Indices of instabilities in `priors.SIZES`, (7,)."""

INSTABILITY_STEPS_DOWN = (3, 6, 9, 40)
"""Steps of `priors.SIZES` by which the instability may decrease when a cause explains
it: by factors of 6, 32 and 180, and to the smallest size."""

LOWERED_TOGETHER = ((0, 1, 2), (3, 4, 5, 6))
"""Instabilities that decrease together: of a triad; closures with the gyroscopes."""

RAISED_CLOSURES = (UNIT_INDEX + 1, UNIT_INDEX + 5)
"""Sizes to which the instability of closures may rise when that of the accelerometers
decreases, since errors of closures come from both: one step above the typical size, and
ten times it."""


def tried_instabilities(
    typical: Array, instability: InstabilityIndices, other: InstabilityIndices | None
) -> list[InstabilityIndices]:
    """A set's instability, and that of another set or some smaller ones.

    `typical` (7,) is the typical instability, 0 where there is none.
    """
    if other is not None:
        return list(dict.fromkeys([instability, other]))
    tried = [instability]
    for lowered in LOWERED_TOGETHER if typical.any() else ():
        for down in INSTABILITY_STEPS_DOWN:
            tried.append(lowered_instability(instability, lowered, down))
    acc = LOWERED_TOGETHER[0]
    if typical[CLOSURE] and max(instability[c] for c in acc) > UNIT_INDEX:
        steady = lowered_instability(instability, acc, INSTABILITY_STEPS_DOWN[-1])
        tried += [
            steady[:CLOSURE] + (max(steady[CLOSURE], up),) for up in RAISED_CLOSURES
        ]
    return list(dict.fromkeys(tried))


def lowered_instability(
    instability: InstabilityIndices, lowered: Sequence[int], down: int
) -> InstabilityIndices:
    """Instabilities with those of the numbers `lowered` lowered by `down` steps."""
    return tuple(
        max(size - down, 0) if i in lowered else size
        for i, size in enumerate(instability)
    )
