"""Scores of sets about their own states.

All sets that a search visits are evaluated with rows that are linearised about one
state, that of the best set. A set that moves a position by a degree is evaluated
wrongly there: the square of the angle is missing, or is there without it. It may seem
less likely than it is, or likelier than the best. Such sets are evaluated about their
own states as well, once for all sets with the same causes in the state.

The square of an angle is as large as a step of the bias that stands for the turn is
exact. So a step of the bias and a turn of the device at the same instant are compared
about both states, even if one of them was too unlikely to be visited.
"""

from __future__ import annotations

import numpy as np

from fieldcal.model import thresholds, tolerances
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.evidence.sizing import Member
from fieldcal.model.search.gauss_newton import state_with_values
from fieldcal.model.search.inference import InferenceResult
from fieldcal.model.system.fitted import estimates_by_column
from fieldcal.physics.attitude_step import AttitudeStep


def correct_scores(found: InferenceResult) -> None:
    """Correct the scores of the likeliest visited sets whose own states are far away.

    The corrections are those of the search, whose scores stay those of its rows.
    """
    sets, best = found.search.sets, found.best
    least = best.score - thresholds.ALTERNATIVE_LOG_DISTANCE
    near = [s for s in sets.visited.values() if s.score > least]
    near.sort(key=lambda s: -s.score)
    bent = _with_turn_or_step(found, least)
    settled, known = 0, {best.keys_in_state}
    for visited in [*bent, *near]:
        keys = visited.keys_in_state
        if keys in known or settled == tolerances.EVALUATED:
            continue
        known.add(keys)
        if visited in bent or linearisation_error(found, visited) > thresholds.VISIBLE:
            settled += 1
            sets.corrections[keys] = _settled_score(found, visited) - visited.score


def _with_turn_or_step(found: InferenceResult, least: float) -> list[Set]:
    """The best set with a turn in the place of another step at its instant, or back.

    Only those whose squares show, and whose score about their own states may be above
    `least`.
    """
    out = []
    best, sets = found.best, found.search.sets
    for i, (old, group) in enumerate(best.members):
        for cause in sets.dictionary.causes if group.begins_at_instant else ():
            first = cause.variants[0]
            if cause.key in best.keys or not first.begins_at_instant:
                continue
            if _turns(first) == _turns(group):
                continue
            new = cause, min(cause.variants, key=lambda g: g.shape_distance(group))
            members = (*best.members[:i], new, *best.members[i + 1 :])
            other = sets.evaluate(members, best.sizes)
            turn, of = (new, other) if _turns(first) else ((old, group), best)
            cost = _cost_of_squares(found, turn, of)
            if cost > thresholds.SIGMA_LOG_LOSS and other.score + cost > least:
                out.append(other)
    return sorted(out, key=lambda s: -s.score)


def _turns(group: Group) -> bool:
    return isinstance(group.effect, AttitudeStep)


def _cost_of_squares(found: InferenceResult, turn: Member, of: Set) -> float:
    """Most by which ln L falls without the squares of the angles of a set's turn."""
    fit = found.fit
    values = np.zeros(fit.dictionary.width)
    values[turn[1].columns] = estimates_by_column(of.state, fit.dictionary)[
        turn[1].columns
    ]
    turned = state_with_values(fit.dictionary, fit.nominal, (turn,), values)
    off = fit.system.linearisation_error(fit.nominal, turned, values, everywhere=True)
    return len(fit.dictionary.window_positions) * off**2 / 2


def linearisation_error(found: InferenceResult, visited: Set) -> float:
    """Largest error of the rows at a set's estimate, in deviations of a mean."""
    state, values = found.fit.state_at_estimate(visited)
    step = values - found.fit.pad(found.values)
    return found.fit.system.linearisation_error(found.state, state, step)


def _settled_score(found: InferenceResult, visited: Set) -> float:
    """Score of a set with rows and turns linearised about its own state."""
    fit = found.independent_fit()
    zeros = np.zeros(fit.dictionary.width)
    state, values, settled = fit.settle(
        fit.nominal, zeros, visited.members, visited.sizes
    )
    sets = Sets(fit.dictionary, fit.gram(state, values, found.best))
    return sets.evaluate(visited.members, settled.sizes).score
