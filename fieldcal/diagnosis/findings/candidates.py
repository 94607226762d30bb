"""The effects that were tried on a recording, and why each was rejected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.agreement import rms_over_parts
from fieldcal.diagnosis.result import Candidate, FoundEffect
from fieldcal.effects import catalogue
from fieldcal.model import thresholds, tolerances
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.held_out import held_out_residuals
from fieldcal.model.search.offers import Offer
from fieldcal.physics.effect import Scatter


def tried_candidates(
    explanation: Explanation, found: Sequence[FoundEffect]
) -> tuple[Candidate, ...]:
    """Every effect that was tried on the rows, by decreasing fall of chi squared."""
    posterior = explanation.posterior
    offers, best = posterior.search.offers, posterior.best
    nothing = posterior.sets.evaluate(())
    alone = _best_offer_by_effect(offers.ranked(nothing))
    beside = _best_offer_by_effect(offers.ranked(best))
    taken = {f.id: f for f in found}
    rows = int(explanation.rows.used.sum())
    losers = (i for i in alone if i in catalogue() and i not in taken)
    followed = list(losers)[: tolerances.PREDICTED_LOSERS]
    out = []
    for id_ in dict.fromkeys(c.name for c in explanation.dictionary.causes):
        effect = catalogue().get(id_)
        if effect is None or isinstance(effect, Scatter):
            continue
        offer = alone.get(id_)
        delta = 2 * _evidence_rise(offer, nothing) if offer else 0.0
        width = len(offer.member[1].columns) if offer else 0
        accepted = taken.get(id_)
        why, gain = "", np.nan
        if accepted:
            gain = accepted.evidence.get("held_out_gain", np.nan)
        else:
            why = _reason_rejected(id_, explanation, offer, beside.get(id_))
        if accepted is None and offer is not None and id_ in followed:
            gain = _held_out_gain_alone(explanation, offers.accept(nothing, offer))
            if gain < -tolerances.ACCUMULATED_ROUNDING:
                why = f"what it was not fitted to it predicts worse; {why}"
        bic = delta - width * float(np.log(rows))
        sure, chosen = posterior.probability([id_]), accepted is not None
        out.append(Candidate(id_, delta, bic, gain, sure, chosen, why))
    return tuple(sorted(out, key=lambda c: -c.delta_chi2))


def _held_out_gain_alone(explanation: Explanation, candidate: Set) -> float:
    """Part of the held-out rms that a set removes, in the channel that changes most."""
    best, empty = explanation.best, explanation.posterior.sets.evaluate(())
    before = rms_over_parts(best.rows, explanation.held_out.residual([empty]))
    after = rms_over_parts(
        best.rows, held_out_residuals(replace(best, set=candidate), [candidate])
    )
    known = np.isfinite(before) & np.isfinite(after) & (before > 0)
    if not known.any():
        return np.nan
    change = np.where(known, before - after, 0.0) / np.nanmax(before)
    c = int(np.argmax(np.abs(change)))
    return float(1 - after[c] / before[c])


def _best_offer_by_effect(offers: Sequence[Offer]) -> Mapping[str, Offer]:
    """The offer with the highest evidence of each effect; offers come best first."""
    found: dict[str, Offer] = {}
    for offer in offers:
        found.setdefault(offer.member[0].name, offer)
    return found


def _evidence_rise(offer: Offer, without: Set) -> float:
    """Rise of ln Z with a cause, without its prior probability; 0 at least."""
    cause = offer.member[0]
    chance = np.log(cause.chance / len(cause.variants))
    return max(offer.score - without.score - float(chance), 0.0)


def _reason_rejected(
    id_: str, explanation: Explanation, alone: Offer | None, beside: Offer | None
) -> str:
    posterior = explanation.posterior
    best = posterior.best
    names = " and ".join(dict.fromkeys(c.name for c, _ in best.members))
    for standing in explanation.probable_causes:
        if id_ in standing.aliases:
            return (
                f"explains it about as well as {standing.name}; this recording cannot"
                " tell"
            )
    rise = _evidence_rise(alone, posterior.sets.evaluate(())) if alone else 0.0
    if rise < thresholds.LITTLE_LOG_GAIN or alone is None:
        return "explains no more than chance would"
    odds = _odds(alone.score - posterior.sets.evaluate(()).score)
    if not best.members:
        return f"takes a little: its odds are {odds}"
    if beside is not None and _evidence_rise(beside, best) > thresholds.LITTLE_LOG_GAIN:
        return f"beside {names} it takes a little, at odds of {odds}"
    return f"{names} already explains it"


def _odds(gain: float) -> str:
    """Odds from their logarithm.

    >>> _odds(0.0), _odds(-3.0), _odds(-80.0)
    ('1 to 1', '1 to 20', 'below 1 to 2e+17')
    """
    if gain > 0:
        more = np.exp(min(gain, thresholds.LARGEST_LOG_ODDS))
        return (
            f"{'above ' if gain > thresholds.LARGEST_LOG_ODDS else ''}{more:.2g} to 1"
        )
    more = np.exp(min(-gain, thresholds.LARGEST_LOG_ODDS))
    if gain < -thresholds.LARGEST_LOG_ODDS:
        return f"below 1 to {more:.0e}"
    return f"1 to {more:.2g}"
