"""What was tried, and why it lost.

Every hypothesis of the search is held against two models: the simulation alone, and
the one that was chosen. By how much the odds (ln Z, with the price for having tried it)
rise beside each of them says why it is not among the effects found. What the strongest
losers predict unseen is worked out as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fieldcal.diagnosis.contender import Model
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.heldout import held_out, rms
from fieldcal.diagnosis.result import Found, number
from fieldcal.diagnosis.rivals import CLOSE
from fieldcal.samples import Array

FOLLOWED = 3
"""Losers whose predictions are worked out: each costs a fit for every position."""

LARGEST = 40.0
"""Odds are not said beyond e to this."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One explanation that was tried.

    Attributes
    ----------
    id : of the effect
    delta_chi2 : by how much the squares fall with it alone
    delta_bic : the same less ln(rows) for every parameter
    held_out_gain : part of the held-out rms that goes with it alone; nan: not looked at
    chosen : whether it is among the effects found
    why : why it lost, in words; empty if it did not

    """

    id: str
    delta_chi2: float
    delta_bic: float
    held_out_gain: float
    chosen: bool
    why: str

    def to_json(self) -> dict[str, Any]:
        """Return the object of diagnosis.json."""
        return {
            "id": self.id,
            "delta_chi2": number(self.delta_chi2),
            "delta_bic": number(self.delta_bic),
            "held_out_gain": number(self.held_out_gain),
            "chosen": self.chosen,
            "why": self.why,
        }


def league(explanation: Explanation, found: Sequence[Found]) -> tuple[Candidate, ...]:
    """Every effect that was tried on the windows, the one that takes most first."""
    search, final = explanation.search, explanation.model
    plain = search.rules.model((), search.bench)
    alone = _best_of_each(search.larger(plain))
    beside = _best_of_each(search.larger(final)) if final.chosen else alone
    instead = _best_of_each(search.rivals(final)) if final.chosen else {}
    taken = {f.id: f for f in found}
    ranked = sorted(alone, key=lambda i: alone[i].fit.chi2)
    losers = [i for i in ranked if i not in taken and _gain(alone[i], plain) > 0]
    followed = losers[:FOLLOWED]
    before = _unseen(plain) if followed else np.full(6, np.nan)
    rows = int(search.bench.rows.used.sum())
    out = []
    for id_ in ranked:
        model, why, gain = alone[id_], "", np.nan
        if id_ in taken:
            gain = taken[id_].evidence.get("held_out_gain", np.nan)
        else:
            why = _why(id_, explanation, alone, beside, instead)
        if id_ in followed:
            gain = _share(before, _unseen(model))
            if gain < 0:
                why = f"what it was not fitted to it predicts worse; {why}"
        delta = plain.fit.chi2 - model.fit.chi2
        paid = len(model.chosen[-1][1].names) * float(np.log(rows))
        out.append(Candidate(id_, delta, delta - paid, gain, id_ in taken, why))
    return tuple(out)


def _best_of_each(models: Sequence[Model]) -> dict[str, Model]:
    """Of an effect's parts the one that does most, by id of what was added last."""
    best: dict[str, Model] = {}
    for model in models:
        id_ = model.chosen[-1][0].effect.id
        if id_ not in best or model.objective > best[id_].objective:
            best[id_] = model
    return best


def _gain(model: Model, less: Model) -> float:
    return model.objective - less.objective


def _why(
    id_: str,
    explanation: Explanation,
    alone: dict[str, Model],
    beside: dict[str, Model],
    instead: dict[str, Model],
) -> str:
    search, final = explanation.search, explanation.model
    names = " and ".join(dict.fromkeys(h.effect.id for h, _ in final.chosen))
    if any(h.effect.id == id_ for m in explanation.rivals for h, _ in m.chosen):
        return f"explains it about as well as {names}; this recording cannot tell"
    gain = _gain(alone[id_], search.rules.model((), search.bench))
    if gain <= 0:
        return f"takes no more than chance would: alone its odds are {_odds(gain)}"
    rest = " and ".join(filter(None, [names, *map(_random, final.random)]))
    if id_ in beside and _gain(beside[id_], final) > -CLOSE:
        return f"beside {rest} it takes a little, at odds of {_odds(gain)}"
    if id_ in instead:
        lost = final.objective - instead[id_].objective
        return f"{rest} takes it and more: in its place the odds are {_odds(-lost)}"
    return f"{rest} takes it: beside that nothing is left for it"


def _random(name: str) -> str:
    return {"walk": "random_walk", "setting": "angle_setting"}.get(
        name.partition(":")[0], "scatter"
    )


def _odds(gain: float) -> str:
    """Odds from their logarithm.

    >>> _odds(0.0), _odds(-3.0), _odds(-80.0)
    ('1 to 1', '1 to 20', 'below 1 to 2e+17')
    """
    if gain > 0:
        more = np.exp(min(gain, LARGEST))
        return f"{'above ' if gain > LARGEST else ''}{more:.2g} to 1"
    more = np.exp(min(-gain, LARGEST))
    if gain < -LARGEST:
        return f"below 1 to {more:.0e}"
    return f"1 to {more:.2g}"


def _unseen(model: Model) -> Array:
    bench = model.bench
    return rms(bench.rows, held_out(bench, model.fit.terms, model.fit))


def _share(before: Array, after: Array) -> float:
    """Part of the held-out rms that goes, in the channel where most goes."""
    known = np.isfinite(before) & np.isfinite(after) & (before > 0)
    if not known.any():
        return np.nan
    c = int(np.argmax(np.abs(np.where(known, before - after, 0.0) / np.nanmax(before))))
    return float(1 - after[c] / before[c])
