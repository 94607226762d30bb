"""What the turns say beyond the windows, one effect after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.course import NOTHING
from fieldcal.diagnosis.estimate import RELAX
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.noise import grain_of
from fieldcal.diagnosis.prepare import Prepared
from fieldcal.diagnosis.reduce import rate_of, spans
from fieldcal.diagnosis.step import bends, moved
from fieldcal.diagnosis.turning import Turning, Turntable
from fieldcal.diagnosis.turns import Turn, turns

ROUGH = 0.7
"""Part of the noise that rounding makes when it is most of it."""

PASSES = 12
"""Of fits to the turns at most, each beginning where the last one came to."""


def turned(
    prepared: Prepared, bench: Bench, fit: Fit, price: float
) -> tuple[tuple[Turn, ...], Turntable | None, Turning | None]:
    """What the turns show beyond the windows."""
    if any(t.effect.kind == "motion" for t in prepared.tones):
        return (), None, None  # a base that rocks turns the device as well
    rough = _rough(prepared, bench)
    made, table, found = _unwound(prepared, bench, fit, price, closures=rough)
    if found is not None and not found.steady and not rough:
        made, table, found = _unwound(prepared, bench, fit, price, closures=True)
    return made, table, found


def _rough(prepared: Prepared, bench: Bench) -> bool:
    """Whether accelerometers are rounded so that a slow turn shows as steps."""
    source = prepared.source
    grain = grain_of(source.block, spans(source.block, source.about))
    return bool((grain[:3] > ROUGH * bench.rows.noise[:3]).any())


def _unwound(
    prepared: Prepared, bench: Bench, fit: Fit, price: float, closures: bool
) -> tuple[tuple[Turn, ...], Turntable | None, Turning | None]:
    """One effect after the other, as long as one more is worth it.

    What is fitted is to first order in the errors of the gyroscopes and in what the
    turns change of the windows' model, so those found are taken out, and the model is
    put where windows and turns agree, before the turns are integrated again.
    """
    interval = 1 / rate_of(prepared.source.block)
    made = tuple(turns(prepared.source, bench.rows, fit))
    table: Turntable | None = None
    found: Turning | None = None
    undo, bent = NOTHING, True
    terms: tuple[Term, ...] = ()
    for _ in range(PASSES if made else 0):
        table = Turntable(bench, fit, made, interval, undo)
        more = table.fit(terms, table.seen(closures), RELAX)
        there = moved(bench, fit, more.values[: len(fit.values)])
        bent = bends(bench, fit, there)
        chosen = terms if bent else table.better(terms, price, closures).terms
        more = table.fit(chosen, table.seen(closures), RELAX)
        back = np.array([undo.of(name) for name in more.names])
        found = replace(more, values=more.values + back)
        if chosen == terms and not bent:
            break
        fit = there if bent else fit
        undo, terms = table.undo(found), chosen
        again = tuple(turns(prepared.source, bench.rows, fit, undo))
        if len(again) != len(made):
            break
        made = again
    return made, table, found
