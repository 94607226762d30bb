"""The search for what explains a recording, windows first, then turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.candidates import Hypothesis, hypotheses
from fieldcal.diagnosis.contender import Model
from fieldcal.diagnosis.estimate import RELAX
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.loosened import Misset, at_an_end, loosened, missets
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.prepare import Prepared, divided, refined
from fieldcal.diagnosis.reduce import rate_of
from fieldcal.diagnosis.rivals import estimated, gauged, with_turns
from fieldcal.diagnosis.select import SEEN, Search
from fieldcal.diagnosis.steps import jump_instant
from fieldcal.diagnosis.together import together
from fieldcal.diagnosis.turning import Turning, Turntable
from fieldcal.diagnosis.turns import Turn
from fieldcal.diagnosis.unwind import turned
from fieldcal.diagnosis.whiten import Errors, Part
from fieldcal.frames import EARTH_RATE

SEES_EARTH = 20.0
"""Earth rate over the noise of one window from which tactical gyroscopes see it."""


TOGETHER = 5.0
"""How much likelier one course has to be than one for each axis, ln."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """What was found.

    Attributes
    ----------
    prepared : the rows it was found in
    always : terms that are in every model: what the simulation has already
    search : the search, with what else was tried
    model : what the windows say
    rivals : models that explain windows and turns about as well
    base : the simulation alone, refitted
    wide : rows with wide priors, and all the scatter there may be
    fit : in them, with the effects of the windows
    left : parameters that the rows leave open
    made : the turns
    table, turning : what the turns say; None where there are none
    instead : what would do as well in turns, by the id of what is in the model
    earth : by how much the Earth's rate raises ln Z; 0 where it is not in the model
    in_step : first channels of the triads whose axes seem to wander, in one course
    misset : angles that single positions were set at otherwise
    unaware : what was found before these were let loose, if there are any

    """

    prepared: Prepared
    always: tuple[Term, ...]
    search: Search
    model: Model
    rivals: tuple[Model, ...]
    base: Fit
    wide: Bench
    fit: Fit
    left: tuple[str, ...]
    made: tuple[Turn, ...]
    table: Turntable | None
    turning: Turning | None
    instead: Mapping[str, tuple[str, ...]]
    earth: float
    in_step: frozenset[int]
    misset: Misset = field(default_factory=dict)
    unaware: Explanation | None = None

    @property
    def terms(self) -> tuple[Term, ...]:
        """Effects of the windows, each once."""
        return tuple(t for t in self.fit.terms if t.columns)

    @property
    def as_said(self) -> Explanation:
        """What was found with every position at the angles that are said."""
        return self.unaware or self

    def plainer(self, other: Explanation) -> bool:
        """Whether turns and windows need less than another explanation has."""
        mine, theirs = (e.turning.terms if e.turning else () for e in (self, other))
        turns = len(mine) < len(theirs) or not (mine or theirs)
        return turns and len(self.terms) < len(other.terms)

    @property
    def sees_earth(self) -> bool:
        """Whether tactical gyroscopes see the Earth's rate in a single window."""
        if self.earth <= self.search.price:
            return False
        bench = self.prepared.bench
        samples = bench.rows.length.sum() / bench.windows
        samples *= rate_of(self.prepared.source.block)
        ratio = EARTH_RATE / (np.nanmax(bench.rows.noise[3:]) / np.sqrt(samples))
        return bool(ratio > SEES_EARTH)


def explain(prepared: Prepared) -> Explanation:
    """Find what explains a recording.

    Where single positions were set at other angles than is said, these are let loose:
    turns end at them as well. What turns say of the gyroscopes shows in the Earth's
    rate, where they see that; the windows are searched again with it then.
    """
    found = _explained(prepared, ())
    unaware, misset = found, missets(found.model, found.wide, found.fit)
    if not misset:
        unaware, misset = _at_an_end(found)
    if misset:
        loose = loosened(prepared, misset)
        aware = _explained(loose, ())
        if unaware is found or aware.plainer(found):
            prepared, found = loose, aware
        else:
            misset = {}
    if prepared.navigation and (rates := _of_rates(found)):
        found = _explained(prepared, rates)
    return replace(found, misset=misset, unaware=unaware) if misset else found


def _at_an_end(found: Explanation) -> tuple[Explanation, Misset]:
    """The same with the first or last position off by itself, and not all the rest."""
    shown = found.turning is not None and found.turning.terms
    if shown or found.model.excess > SEEN:
        if (model := at_an_end(found.search, found.model)) is not None:
            wide, fit, _ = estimated(found.search, model)
            other = replace(found, model=model, wide=wide, fit=fit)
            return other, missets(model, wide, fit)
    return found, {}


def _explained(prepared: Prepared, told: tuple[Term, ...]) -> Explanation:
    """What explains windows, and then turns; `told` is known of the windows' rates."""
    always = (*prepared.known, *told)
    prepared, search, model, rivals = _searched(prepared, always)
    wide, fit, left = estimated(search, model)
    made, table, turning = turned(prepared, wide, untold(fit, told), search.price)
    better, instead = gauged(prepared, search, model, turning)
    if better is not model:
        model = better
        wide, fit, left = estimated(search, model)
        made, table, turning = turned(prepared, wide, untold(fit, told), search.price)
    return Explanation(
        prepared,
        prepared.known,
        search,
        model,
        rivals,
        prepared.bench.fit(prepared.known),
        wide,
        fit,
        left,
        made,
        table,
        turning,
        instead,
        _earth(search, model),
        _in_step(prepared, model, fit),
    )


def _searched(
    prepared: Prepared, always: tuple[Term, ...]
) -> tuple[Prepared, Search, Model, tuple[Model, ...]]:
    """The best model and its rivals, with rows that suit what they found.

    A jump divides a row, and what settles is counted from when it really begins.
    """

    def search() -> Search:
        return Search(prepared.bench, _pool(prepared, prepared.bench), always)

    tried = search()
    best = tried.run()
    if (at := _jump(prepared, tried, best)) is not None:
        prepared = divided(prepared, at)
        tried = search()
        best = tried.run()
    model, rivals = with_turns(prepared, tried, best)
    if any(h.effect.id == "settling" for h, _ in model.chosen):
        prepared = refined(prepared, model.fit)
        bench = prepared.bench.but(errors=model.bench.errors)
        tried = search()
        fitted = tried.rules.model
        model = fitted(model.chosen, bench, None, model.random, model.shaped)
    return prepared, tried, model, rivals


def _jump(prepared: Prepared, search: Search, model: Model) -> float | None:
    """When the biases jumped, s, if they did."""
    for term in model.fit.terms:
        if "at_s" in term.shape:
            less = search.without(model, term.effect.id)
            return jump_instant(
                prepared.source, model.bench, less.fit, model.fit, term
            )[0]
    return None


def _of_rates(found: Explanation) -> tuple[Term, ...]:
    """What the turns showed of the gyroscopes, with its values."""
    if (turning := found.turning) is None:
        return ()
    values = dict(zip(turning.names, turning.values.tolist(), strict=True))
    return tuple(
        replace(
            term,
            columns=(),
            start=tuple(values[f"{term.effect.id}.{n}"] for n in term.names),
        )
        for term in turning.terms
        if term.effect.id.startswith("gyro")
    )


def untold(fit: Fit, told: tuple[Term, ...]) -> Fit:
    """A fit without terms that are known: the turns are to find them themselves."""
    pairs = zip(fit.state.terms, fit.state.values, strict=True)
    kept = [(t, v) for t, v in pairs if t not in told]
    terms, values = tuple(t for t, _ in kept), tuple(v for _, v in kept)
    return replace(fit, state=replace(fit.state, terms=terms, values=values))


def bare(prepared: Prepared, model: Model, fit: Fit) -> tuple[Bench, Fit]:
    """The effects that were found, without anything random but the angles' setting."""
    errors = replace(model.bench.errors, parts=())
    bench = prepared.bench.but(errors=errors, relax=RELAX)
    return bench, bench.fit(fit.terms, fit)


def _in_step(prepared: Prepared, model: Model, fit: Fit) -> frozenset[int]:
    """Triads of which the axes seem to wander, but follow one course.

    Biases wander each for itself.
    """
    out = set()
    for first in (0, 3):
        errors = model.bench.errors
        axes = {p.channel for p in wandering(errors, first)}
        if axes:  # one that is smooth may be of the same course
            axes |= {
                p.channel
                for p in errors.parts
                if p.kind.endswith("time") and p.channel // 3 == first // 3
            }
        if len(axes) > 1:
            if together(*bare(prepared, model, fit), sorted(axes)) > TOGETHER:
                out.add(first)
    return frozenset(out)


def wandering(errors: Errors, first: int) -> list[Part]:
    """Walks and offsets of the triad that begins with a channel."""
    return [
        p
        for p in errors.parts
        if p.kind in ("walk", "offset") and first <= p.channel < first + 3
    ]


def _pool(prepared: Prepared, bench: Bench) -> list[Hypothesis]:
    return hypotheses(bench, prepared.source.warmth.changes, prepared.navigation)


def _earth(search: Search, model: Model) -> float:
    """By how much the Earth's rate raises ln Z, if it is in the model."""
    there = [h.effect.id == "earth_rate" for h, _ in model.chosen]
    if not any(there):
        return 0.0
    at = there.index(True)
    chosen = model.chosen[:at] + model.chosen[at + 1 :]
    less = search.rules.model(chosen, model.bench, model.fit, model.random)
    return model.fit.score - less.fit.score
