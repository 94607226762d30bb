"""Scores of sets about their own states.

All sets that a search visits are evaluated with rows that are linearised about one
state, that of the best set. A set that moves a position by a degree is evaluated
wrongly there: the square of the angle is missing, or is there without it. It may seem
less likely than it is, or likelier than the best. Such sets are evaluated about their
own states as well, once for all sets with the same causes in the state.
"""

from __future__ import annotations

import numpy as np

from fieldcal.model import thresholds, tolerances
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.search.inference import InferenceResult


def correct_scores(found: InferenceResult) -> None:
    """Correct the scores of the likeliest visited sets whose own states are far away.

    The corrections are those of the search, whose scores stay those of its rows.
    """
    sets, best = found.search.sets, found.best
    near = [s for s in sets.visited.values()
            if s.score > best.score - thresholds.ALTERNATIVE_LOG_DISTANCE]  # fmt: skip
    settled, known = 0, {best.keys_in_state}
    for visited in sorted(near, key=lambda s: -s.score):
        keys = visited.keys_in_state
        if keys in known or settled == tolerances.EVALUATED:
            continue
        known.add(keys)
        if linearisation_error(found, visited) > thresholds.VISIBLE:
            settled += 1
            sets.corrections[keys] = _settled_score(found, visited) - visited.score


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
