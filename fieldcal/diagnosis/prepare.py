"""From a recording to rows that hypotheses can be fitted to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.description import Description
from fieldcal.diagnosis.candidates import hypotheses
from fieldcal.diagnosis.chain import Checked, check, checked_again
from fieldcal.diagnosis.dwell import arrivals, beginnings, clamped
from fieldcal.diagnosis.fit import Bench, Fit
from fieldcal.diagnosis.hand import rows_of
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.noise import white
from fieldcal.diagnosis.reduce import Source, rate_of, spans
from fieldcal.diagnosis.spectrum import Tone, tones, without
from fieldcal.diagnosis.thermometer import Thermometer
from fieldcal.effects import Chain, Line, Scatter, catalogue
from fieldcal.errors import InputError
from fieldcal.samples import Array, Block

SHORTEST = 20
"""Samples of a window from which it can be used."""

BETTER = 3.0


@dataclass(frozen=True, slots=True)
class Prepared:
    """A recording, checked, cleaned of lines and reduced.

    Attributes
    ----------
    checked : what the checks of the chain found
    source : samples and what rows are made of
    bench : the rows
    known : effects that the simulation has already
    tones : lines found, and taken out of the samples
    rest : (p,) ends of the motion before each window, s

    """

    checked: Checked
    source: Source
    bench: Bench
    known: tuple[Term, ...]
    tones: tuple[Tone, ...]
    rest: Array

    @property
    def navigation(self) -> bool:
        """Whether the gyroscopes are said to see the Earth."""
        return self.source.about.grade == "navigation"


def prepare(block: Block, about: Description) -> Prepared:
    """Check, clean and reduce a recording.

    Raises
    ------
    InputError
        If no window holds enough samples.

    """
    _refuse_empty(block, about)
    known = known_terms(about.model)
    checked = check(block, about)
    windows, rate = spans(checked.block, about), rate_of(checked.block)
    six = np.where(checked.usable, checked.block.six, np.nan)
    noise = white([six[a:b] for a, b in windows if b > a], rate)
    rest = arrivals(checked.block, about, noise)
    warmth = Thermometer.of(checked.block)
    source = Source(checked.block, about, checked.usable, rest, warmth, checked.pace)
    rows = rows_of(source)
    found = tuple(tones(source, rows))
    if found:
        source = replace(source, block=without(source.block, source, rows, found))
        checked = checked_again(checked, source.block, about)
    source = _counted(source, known)
    return Prepared(checked, source, bench_of(source), known, found, rest)


def bench_of(source: Source) -> Bench:
    """The rows of a source with the calibration a simulation starts from."""
    nominal = source.about.nominal
    return Bench(
        rows_of(source),
        np.concatenate([nominal["acc_bias"], nominal["gyr_bias"]]),
        np.concatenate([nominal["acc_scale"], nominal["gyr_scale"]]),
    )


def _refuse_empty(block: Block, about: Description) -> None:
    windows = spans(block, about)
    if not (windows[:, 1] - windows[:, 0] >= SHORTEST).any():
        held = len(about.positions)
        raise InputError(
            f"none of the {held} windows in session.toml holds {SHORTEST} samples; the"
            f" samples run from {block.t[0]:g} to {block.t[-1]:g} s of device time:"
            " check start_s and end_s"
        )
    if not np.isfinite(block.six).any():
        raise InputError("the samples hold no output of any sensor; record them again")


def known_terms(model: Mapping[str, Mapping[str, Any]]) -> tuple[Term, ...]:
    """Effects that [model] gives the simulation, with their values fixed.

    Raises
    ------
    InputError
        If an id is not in the catalogue, or a parameter not the effect's.

    """
    out = []
    for name, table in model.items():
        if (effect := catalogue().get(name)) is None:
            raise InputError(f"[model] effects: {name!r} is no effect in the catalogue")
        wrong = [key for key in table if key not in effect.names]
        if wrong:
            raise InputError(
                f"[model.{name}] {wrong[0]} is no parameter of it; it has"
                f" {', '.join(effect.names) or 'none'}"
            )
        if isinstance(effect, Chain | Line | Scatter):
            continue
        start = tuple(float(table.get(p.name, 0.0)) for p in effect.params)
        missing = [s.name for s in effect.shapes if s.name not in table]
        if missing:
            raise InputError(f"[model.{name}] needs {missing[0]} as well")
        shape = {s.name: float(table[s.name]) for s in effect.shapes}
        out.append(Term(effect, (), shape, start=start))
    return tuple(out)


def _counted(source: Source, known: tuple[Term, ...]) -> Source:
    """With what settles counted from the instant that fits best.

    That is the end of the motion, or a fixed time before each window; any fixed time
    gives the same course inside windows, so the windows' starts stand for it here. And
    before the first window the device may have been turned, or not.
    """
    if not source.about.positions:
        return source
    starts = beginnings(source)
    held = np.flatnonzero(np.diff(spans(source.block, source.about), axis=1)[:, 0] > 0)
    first = np.arange(len(starts)) == held[0]
    best, most = source, _settles(source, known) + BETTER
    for arrived in (source.arrived, starts):
        for tried in (arrived, np.where(first, -np.inf, arrived)):
            other = replace(source, arrived=tried)
            if tried is not source.arrived and (gain := _settles(other, known)) > most:
                best, most = other, gain
    return best


def _settles(source: Source, known: tuple[Term, ...]) -> float:
    """How much settling raises ln Z, over both triads."""
    bench = bench_of(source)
    plain, total = bench.fit(known), 0.0
    for hypothesis in hypotheses(bench, False, False):
        if hypothesis.effect.id == "settling":
            fits = [bench.fit([*known, term], plain) for term in hypothesis.variants]
            total += max(0.0, max(fit.score for fit in fits) - plain.score)
    return total


def refined(prepared: Prepared, fit: Fit) -> Prepared:
    """With settling counted from the instant that the samples before windows show."""
    turned = np.isfinite(prepared.source.arrived)
    rest = np.where(turned, prepared.rest, -np.inf)
    plain = replace(prepared.source, arrived=rest)
    arrived = clamped(plain, prepared.bench, fit)
    source = replace(prepared.source, arrived=arrived)
    return replace(prepared, source=source, bench=bench_of(source))
