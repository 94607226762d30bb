"""Models that windows and turns together hold against each other.

What turns say of a model's gyroscopes counts with what windows say: the evidence of
both is what a model is judged by, and what its rivals come close to. A gauge of the
angles with a scale error and gyroscopes with one look the same in turns; which of them
it is, windows tell, or nothing does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.diagnosis.bench import Bench
from fieldcal.diagnosis.contender import Model
from fieldcal.diagnosis.estimate import estimate
from fieldcal.diagnosis.fit import Fit
from fieldcal.diagnosis.model import Term
from fieldcal.diagnosis.prepare import Prepared
from fieldcal.diagnosis.reduce import rate_of
from fieldcal.diagnosis.select import Search
from fieldcal.diagnosis.turning import Turning, Turntable
from fieldcal.diagnosis.turns import turns

CLOSE = 4.6
"""Of ln 100: an explanation a hundred times less likely is no rival."""

NEARBY, RIVALS = 15.0, 4
"""How close, by the windows alone, a model must come for its turns to be looked at."""

THERMAL = {*("temperature_bias", "temperature_scale"), "thermal_hysteresis", "warm_up"}

LAG = 0.05
"""Part of its course by which the sensors' temperature is not the thermometer's."""

GAUGE = "angle_scale"
TURNED = ("gyro_scale", "gyro_cross_coupling")
"""What has turns come out otherwise than the angles say."""


def estimated(search: Search, model: Model) -> tuple[Bench, Fit, tuple[str, ...]]:
    """The rows with wide priors, the model in them, and what they leave open."""
    whole = [replace(t, columns=h.variants[0].columns) for h, t in model.chosen]
    terms = [*search.rules.always, *merged(whole)]
    return estimate(model.bench, terms, model.fit)


def with_turns(
    prepared: Prepared, search: Search, best: Model
) -> tuple[Model, tuple[Model, ...]]:
    """The best model of windows and turns, and the rivals that come close to it."""
    level = worth(best) - NEARBY
    close = [
        m for m in search.rivals(best) if worth(m) + allowed(search, best, m) > level
    ]
    close = [best, *sorted(close, key=lambda m: -m.objective)[:RIVALS]]
    if len(close) == 1:
        return best, ()
    gains = [_by_turns(prepared, search, m) for m in close]
    totals = [m.objective + g for m, g in zip(close, gains, strict=True)]
    first = int(np.argmax(totals))
    chosen, others = close[first], []
    for model, gain in zip(close, gains, strict=True):
        less = worth(chosen) + gains[first] - worth(model) - gain
        if model is not chosen and less < CLOSE + allowed(search, chosen, model):
            others.append(model)
    return chosen, tuple(others)


def gauged(
    prepared: Prepared, search: Search, model: Model, turning: Turning | None
) -> tuple[Model, Mapping[str, tuple[str, ...]]]:
    """The model with the angles' gauge in it, if turns are so explained the better.

    Returns
    -------
    model : the better one
    instead : by what it has for the turns' sake, what would do as well there

    """
    shown = tuple(i for i in turning.ids if i in TURNED) if turning else ()
    pool = [h for h in search.pool if h.effect.id == GAUGE]
    if not shown or not pool or pool[0].name in model.names:
        return model, {}
    other = search.with_one(model, pool[0])
    if other.objective < model.objective - NEARBY:
        return model, {}
    ahead = other.objective + _by_turns(prepared, search, other)
    ahead -= model.objective + _by_turns(prepared, search, model)
    if ahead > 0:
        return other, {GAUGE: shown if ahead < CLOSE else ()}
    return model, {i: (GAUGE,) for i in shown} if ahead > -CLOSE else {}


def _by_turns(prepared: Prepared, search: Search, model: Model) -> float:
    """What turns add to the evidence of a model, with one effect of theirs, ln."""
    wide, fit, _ = estimated(search, model)
    made = turns(prepared.source, wide.rows, fit)
    if not made:
        return 0.0
    table = Turntable(wide, fit, made, 1 / rate_of(prepared.source.block))
    found = table.better((), search.price, closures=False)
    score = found.score - search.price * len(found.terms)
    # turns that nothing explains well do not tell much about the rest
    return score / max(1.0, found.chi2 / max(found.dof, 1))


def worth(model: Model) -> float:
    """Evidence of a model, ln, whatever the choice of its effects' variants cost.

    That is paid for believing an effect, not for whether it would explain the same.
    """
    return model.objective + sum(model.shaped)


def preferred(model: Model) -> float:
    """What a model paid for effects that are second choice by their nature, ln."""
    return sum(h.cost for h, _ in model.chosen)


def allowed(search: Search, best: Model, other: Model) -> float:
    """What another model may fall short by for the thermometer alone, ln.

    The sensors are not where the thermometer is: their temperature is known to a part
    of its course only. Of what an effect of it explains, the square of that part says
    nothing about which effect it is.
    """
    mine, theirs = (
        {h.effect.id for h, _ in m.chosen if not h.known} for m in (best, other)
    )
    if not mine ^ theirs <= THERMAL or not mine - theirs:
        return 0.0
    less = best
    for cause in mine - theirs:
        less = search.without(less, cause)
    return LAG**2 * (best.fit.score - less.fit.score)


def merged(terms: Sequence[Term]) -> list[Term]:
    """Terms of one effect put together."""
    out: dict[str, Term] = {}
    for term in terms:
        old = out.get(term.effect.id)
        columns = tuple(sorted({*(old.columns if old else ()), *term.columns}))
        out[term.effect.id] = replace(old or term, columns=columns)
    return list(out.values())
