"""Which other effects would explain the same in this recording, and what would tell.

A model with one effect exchanged for another that comes close to the best, windows and
turns together, makes the two aliases. What decides between two
is the position, in reach of a fixture, at which they predict the most different
outputs, or failing that what the effect's own entry in the catalogue says.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fieldcal.diagnosis.contender import Model, foretells
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.rivals import CLOSE, allowed, preferred
from fieldcal.diagnosis.scatter import wanders
from fieldcal.diagnosis.select import MARGIN, TIE
from fieldcal.effects import Experience, catalogue
from fieldcal.frames import turn

RANDOM = {"walk": "random_walk", "setting": "angle_setting"}

REACH = (0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0)
SEVERAL = 3
"""Causes that are looked at in the place of chance."""

SAME, PART = 2 * CLOSE, 0.1
"""Squares that a rival may leave more, at most this part of what is explained."""

PLAUSIBLE = 10.0
"""Times what is seen of an effect that its values may be then."""

TELLING = 5.0
"""Difference in white noise of a window's mean that decides."""


@dataclass(frozen=True, slots=True)
class Aliases:
    """What else would explain the same.

    Attributes
    ----------
    ids : of other effects, by the id of the one chosen
    open : chosen ids of which no other is second choice by its nature

    """

    ids: Mapping[str, tuple[str, ...]]
    open: frozenset[str]


def aliases(explanation: Explanation) -> Aliases:
    """Other effects that would do, for each that was chosen."""
    found: dict[str, list[str]] = {}
    undecided = set()
    cost = preferred(explanation.model)
    mine = _causes(explanation.model)
    for rival in explanation.rivals:
        slack = allowed(explanation.search, explanation.model, rival)
        if not _foretells(explanation.model, rival, slack):
            continue
        theirs = _causes(rival)
        for name in sorted(mine - theirs):
            _add(found, name, sorted(theirs - mine))
            if theirs - mine and preferred(rival) <= cost:
                undecided.add(name)
    for name, likewise in _alike(explanation):
        _add(found, name, likewise)
    for name, chance in _chances(explanation):
        _add(found, name, [chance])
        undecided.add(name)
    for name, others in explanation.instead.items():  # windows alone do not count there
        found[name] = list(others)
        undecided = undecided | {name} if others else undecided - {name}
    ids = {name: tuple(there) for name, there in found.items() if there}
    return Aliases(ids, frozenset(undecided))


def _alike(explanation: Explanation) -> Iterator[tuple[str, list[str]]]:
    """Effects in whose place others leave no more, at the price of more parameters.

    The price is for what is to be believed; what the recording cannot tell apart by its
    fit, it cannot tell apart.
    """
    search, best = explanation.search, explanation.model
    mine = set() if best.random else _causes(best)  # chance makes up for what is wrong
    spare = {
        name: min(SAME, PART * (search.without(best, name).fit.chi2 - best.fit.chi2))
        for name in mine
    }
    for rival in search.rivals(best):
        theirs, more = _causes(rival), rival.fit.chi2 - best.fit.chi2
        for name in sorted(mine - theirs) if rival.excess < PLAUSIBLE else ():
            if more < spare[name]:
                yield name, sorted(theirs - mine)


def _causes(model: Model) -> set[str]:
    return {h.effect.id for h, _ in model.chosen if not h.known}


def _add(found: dict[str, list[str]], name: str, ids: list[str]) -> None:
    there = found.setdefault(name, [])
    there += [i for i in ids if i not in there]


def _chances(explanation: Explanation) -> Iterator[tuple[str, str]]:
    """Effects that chance would do for as well, and the other way about."""
    search, best = explanation.search, explanation.model
    level, near = best.objective - CLOSE, best.objective - TIE
    for less in search.smaller(best):
        gone = _causes(best) - _causes(less)
        for wander in wanders(less.bench, less.fit) if gone else ():
            id_ = RANDOM.get(wander.name.partition(":")[0])
            if id_ and less.objective + wander.gain - search.price > level:
                if _foretells(best, search.with_random(less, wander)):
                    yield from ((name, id_) for name in gone)
        for name in set(best.random) - set(less.random):
            if (id_ := RANDOM.get(name.partition(":")[0])) is not None:
                ranked = sorted(search.larger(less), key=lambda m: -m.objective)
                for other in ranked[:SEVERAL]:
                    newest = other.chosen[-1][0]
                    if other.objective > near and not newest.known:
                        if _foretells(best, other):
                            yield id_, newest.effect.id


def _foretells(best: Model, other: Model, slack: float = 0.0) -> bool:
    """Whether another model predicts positions left out about as well."""
    return foretells(other) > foretells(best) - MARGIN - slack


def telling_position(
    explanation: Explanation, one: str, other: str
) -> tuple[float, float, float] | None:
    """Position at which two explanations differ most, and by how many sigmas.

    Returns
    -------
    alpha, beta in degrees and the difference, or None if no position in reach tells

    """
    models = {name: _with(explanation, one, name) for name in (one, other)}
    rows = explanation.prepared.bench.rows
    if any(m is None for m in models.values()) or not rows.x.oriented.all():
        return None
    x, best = rows.x, None
    sd = np.nanmedian(rows.sd, axis=0) / np.sqrt(
        max(len(x) / max(x.position[-1], 1), 1)
    )
    sd = np.hypot(sd, np.nanmedian(rows.common, axis=0))
    for alpha in REACH:
        for beta in REACH[:5]:
            place = _place(x, alpha, beta)
            seen = [m.fit.state.predict(place) for m in models.values() if m]
            apart = float(np.nanmax(np.abs(seen[0] - seen[1]) / sd))
            if best is None or apart > best[2] * 1.2:
                best = (alpha, beta, apart)
    return best if best is not None and best[2] > TELLING else None


def _with(explanation: Explanation, one: str, name: str) -> Model | None:
    """The best model with an effect in the place of the chosen one."""
    search, best = explanation.search, explanation.model
    if name == one:
        return best
    less = search.without(best, one)
    for hypothesis in search.pool:
        if hypothesis.effect.id == name:
            less = search.with_one(less, hypothesis)
    return less


def _place(x: Experience, alpha: float, beta: float) -> Experience:
    """One row in a position, late in the session and in its window."""
    a, b = np.deg2rad([[alpha], [beta]])
    last = slice(len(x) - 1, len(x))
    force = x.mounting.T @ turn(a, b) @ x.base_force
    return Experience.at_rest(
        a,
        b,
        x.gravity,
        f=force,
        t=x.t[last],
        since_start=x.since_start[last],
        since_turn=x.since_turn[last],
        warming=x.warming[last],
        heating=x.heating[last],
        variance=x.variance[last],
        position=np.array([-1]),
        base_force=x.base_force,
        base_rate=x.base_rate,
        mounting=x.mounting,
        latitude=x.latitude,
    )


def decided_by(name: str) -> str:
    """What the catalogue says tells an effect from others."""
    return catalogue()[name].decided_by
