"""The search for what explains a recording, windows first, then turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.diagnosis.candidates import Hypothesis, hypotheses
from fieldcal.diagnosis.estimate import RELAX, estimate
from fieldcal.diagnosis.fit import Bench, Fit
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.prepare import Prepared, refined
from fieldcal.diagnosis.reduce import rate_of
from fieldcal.diagnosis.select import Model, Search
from fieldcal.diagnosis.turning import Turning, Turntable
from fieldcal.diagnosis.turns import Turn, turns
from fieldcal.effects import catalogue
from fieldcal.frames import EARTH_RATE

PASSES = 2

CLOSE = 4.6
"""Of ln 100: an explanation a hundred times less likely is no rival."""

NEARBY, RIVALS = 15.0, 4
"""How close, by the windows alone, a model must come for its turns to be looked at."""

SEES_EARTH = 20.0
"""Earth rate over the noise of one window from which tactical gyroscopes see it."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """What was found.

    Attributes
    ----------
    prepared : the rows it was found in
    always : terms that are in every model: what the simulation has, the Earth
    search : the search, with what else was tried
    model : what the windows say
    rivals : models that explain windows and turns about as well
    base : the simulation alone, refitted
    fit : with the effects of the windows, wide priors
    left : parameters that the rows leave open
    made : the turns
    table, turning : what the turns say; None where there are none
    earth : by how much the Earth's rate raises ln Z; 0 where it is not in question

    """

    prepared: Prepared
    always: tuple[Term, ...]
    search: Search
    model: Model
    rivals: tuple[Model, ...]
    base: Fit
    fit: Fit
    left: tuple[str, ...]
    made: tuple[Turn, ...]
    table: Turntable | None
    turning: Turning | None
    earth: float

    @property
    def terms(self) -> tuple[Term, ...]:
        """Effects of the windows, each once."""
        return tuple(t for t in self.fit.terms if t.columns)

    @property
    def sees_earth(self) -> bool:
        """Whether tactical gyroscopes see the Earth's rate in a single window."""
        bench = self.prepared.bench
        samples = bench.rows.length.sum() / bench.windows
        samples *= rate_of(self.prepared.source.block)
        ratio = EARTH_RATE / (np.nanmax(bench.rows.noise[3:]) / np.sqrt(samples))
        return self.earth > self.search.price and bool(ratio > SEES_EARTH)


def explain(prepared: Prepared) -> Explanation:
    """Find what explains a recording."""
    always, earth = _always(prepared)
    search = Search(prepared.bench, _pool(prepared, prepared.bench), always)
    model, rivals = _with_turns(prepared, search, search.run())
    if any(h.effect.id == "settling" for h, _ in model.chosen):
        prepared = refined(prepared, model.fit)
        errors = model.bench.errors
        bench = prepared.bench.but(errors=errors)
        search = Search(prepared.bench, _pool(prepared, prepared.bench), always)
        model = search.model(model.chosen, bench, None, model.random, model.shaped)
    fit, left = _estimated(search, model)
    made, table, turning = _turned(prepared, model, fit, search.price)
    base = prepared.bench.fit(always)
    return Explanation(
        prepared,
        always,
        search,
        model,
        rivals,
        base,
        fit,
        left,
        made,
        table,
        turning,
        earth,
    )


def _estimated(search: Search, model: Model) -> tuple[Fit, tuple[str, ...]]:
    whole = [replace(t, columns=h.variants[0].columns) for h, t in model.chosen]
    terms = [*search.always, *merged(whole)]
    return estimate(model.bench, terms, model.fit)


def _with_turns(
    prepared: Prepared, search: Search, best: Model
) -> tuple[Model, tuple[Model, ...]]:
    """The best model of windows and turns, and the rivals that come close to it."""
    close = [m for m in search.rivals(best) if m.objective > best.objective - NEARBY]
    close = [best, *sorted(close, key=lambda m: -m.objective)[:RIVALS]]
    if len(close) == 1:
        return best, ()
    gains = []
    for model in close:
        fit, _ = _estimated(search, model)
        made = turns(prepared.source, model.bench.rows, fit)
        if made:
            interval = 1 / rate_of(prepared.source.block)
            found = Turntable(model.bench, fit, made, interval).best(search.price)
            gains.append(found.score - search.price * len(found.terms))
        else:
            gains.append(0.0)
    totals = [m.objective + g for m, g in zip(close, gains, strict=True)]
    first = int(np.argmax(totals))
    level = totals[first] + preferred(close[first]) - CLOSE
    rivals = [m for m, t in zip(close, totals, strict=True) if t + preferred(m) > level]
    return close[first], tuple(m for m in rivals if m is not close[first])


def preferred(model: Model) -> float:
    """What a model paid for effects that are second choice by their nature, ln."""
    return sum(h.cost for h, _ in model.chosen)


def _pool(prepared: Prepared, bench: Bench) -> list[Hypothesis]:
    return hypotheses(bench, prepared.source.warmth.changes, prepared.navigation)


def _always(prepared: Prepared) -> tuple[tuple[Term, ...], float]:
    """What the simulation has, and the Earth's rate where the gyroscopes show it."""
    known, bench = prepared.known, prepared.bench
    seen = bench.rows.used[:, 3:].any() and bool(bench.rows.x.oriented.any())
    there = any(t.effect.id == "earth_rate" for t in known)
    if prepared.navigation or there or not seen:
        return known, 0.0
    earth = Term(catalogue()["earth_rate"], ())
    plain = bench.fit(known)
    gain = bench.fit([*known, earth], plain).score - plain.score
    return ((*known, earth), gain) if gain > 0 else (known, 0.0)


def merged(terms: Sequence[Term]) -> list[Term]:
    """Terms of one effect put together."""
    out: dict[str, Term] = {}
    for term in terms:
        old = out.get(term.effect.id)
        columns = tuple(sorted({*(old.columns if old else ()), *term.columns}))
        out[term.effect.id] = replace(old or term, columns=columns)
    return list(out.values())


def _turned(
    prepared: Prepared, model: Model, fit: Fit, price: float
) -> tuple[tuple[Turn, ...], Turntable | None, Turning | None]:
    """What the turns show beyond the windows."""
    made = tuple(turns(prepared.source, model.bench.rows, fit))
    if not made:
        return (), None, None
    interval = 1 / rate_of(prepared.source.block)
    table = Turntable(model.bench, fit, made, interval)
    found = table.best(price)
    return made, table, _settled(prepared, model, fit, table, found, interval)


def _settled(
    prepared: Prepared,
    model: Model,
    fit: Fit,
    table: Turntable,
    found: Turning,
    interval: float,
) -> Turning:
    """The same effects with wide priors, gyroscope errors taken out and fitted again.

    What is fitted is to first order in the errors; what is left after taking them out
    is small.
    """
    out = table.fit(found.terms, found.rows, RELAX)
    for _ in range(PASSES if found.terms else 0):
        undo = table.undo(out)
        rows = model.bench.rows
        made = turns(prepared.source, rows, fit, undo)
        again = Turntable(model.bench, fit, made, interval)
        if len(again.turn) != len(found.rows):
            break
        more = again.fit(found.terms, found.rows, RELAX)
        there = [undo.of(name) for name in more.names]
        out = replace(more, values=more.values + np.array(there))
    return out
