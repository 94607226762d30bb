"""Positions that were set at other angles than is said, let loose.

Turns end at them as well: laid to the gyroscopes, an angle that is a degree off makes
large errors of theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.contender import Model
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.misplaced import JOINTS, Turned, misplaced
from fieldcal.diagnosis.prepare import Prepared
from fieldcal.diagnosis.scatter import alone
from fieldcal.diagnosis.select import Search

Misset = Mapping[int, tuple[Turned, ...]]
"""Angles that single positions were set at otherwise."""


def missets(model: Model, wide: Bench, fit: Fit) -> Misset:
    """Positions that are off by themselves, of which the angles explain it."""
    out: dict[int, tuple[Turned, ...]] = {}
    for part in model.bench.errors.parts:
        position = part.window
        if position is not None and part.channel < len("xyz") and position not in out:
            out[position] = misplaced(wide, fit, position)
    return {position: angles for position, angles in out.items() if angles}


def at_an_end(search: Search, model: Model) -> Model | None:
    """The model with its step of a bias taken for one position that is off by itself.

    In the windows the two are one where the step parts the first or the last window
    from the rest; None where it does not.
    """
    span, position = model.bench.rows.span, model.bench.rows.x.position
    held = np.unique(position)
    for term in model.fit.terms:
        if "at_s" not in term.shape:
            continue
        later = np.unique(position[span[:, 0] >= term.shape["at_s"]])
        if len(later) in (1, len(held) - 1):
            end = held[-1] if len(later) == 1 else held[0]
            less = search.without(model, term.effect.id)
            return search.with_random(less, alone(less.bench, less.fit, int(end)))
    return None


def loosened(prepared: Prepared, misset: Misset) -> Prepared:
    """With single positions where they seem to be, and their angles estimated."""
    bench = prepared.bench
    angles = {joint: getattr(bench.rows.x, joint).copy() for joint in JOINTS}
    for position, wrong in misset.items():
        inside = bench.rows.x.position == position
        for one in wrong:
            angles[one.joint][inside] += np.deg2rad(one.angle.value)
    rows = replace(bench.rows, x=bench.rows.x.turned(**angles))
    errors = replace(bench.errors, loose=tuple(sorted(misset)))
    return replace(prepared, bench=bench.but(rows=rows, errors=errors))
