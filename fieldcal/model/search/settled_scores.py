"""Scores of sets about their own states.

All sets that a search visits are evaluated with rows that are linearised about one
state, that of the best set. A set that moves a position by a degree is evaluated
wrongly there: the square of the angle is missing, or is there without it. It may seem
less likely than it is, or likelier than the best. Such sets are evaluated about their
own states as well, once for all sets with the same causes in the state.
"""

from __future__ import annotations

import numpy as np

from fieldcal.model.evidence.sets import Set
from fieldcal.model.search.inference import Inference, InferenceResult
from fieldcal.model.search.selection import ALTERNATIVE_MARGIN, Search

VISIBLE_ERROR = 1.0
"""Error of a linearised mean that shows, in its standard deviations."""

MAX_SETTLED_SETS = 4
"""Largest number of states about which sets are evaluated."""


def correct_scores(found: InferenceResult) -> None:
    """Correct the scores of the likeliest visited sets whose own states are far away.

    The corrections are those of the search, whose scores stay those of its rows.
    """
    search, best = found.search, found.best
    near = [
        one
        for one in search.visited.values()
        if one.score > best.score - ALTERNATIVE_MARGIN
    ]
    settled, known = 0, {best.keys_in_state}
    for one in sorted(near, key=lambda s: -s.score):
        if one.keys_in_state in known or settled == MAX_SETTLED_SETS:
            continue
        known.add(one.keys_in_state)
        if linearisation_error(found, one) > VISIBLE_ERROR:
            settled += 1
            search.corrections[one.keys_in_state] = (
                _settled_score(found, one) - one.score
            )


def linearisation_error(found: InferenceResult, there: Set) -> float:
    """Largest error of the rows at a set's estimate, in deviations of a mean."""
    inference: Inference = found.inference
    state, values = inference.state_at_estimate(there)
    step = values - inference.pad(found.values)
    return inference.system.linearisation_error(found.state, state, step)


def _settled_score(found: InferenceResult, there: Set) -> float:
    """Score of a set with rows and turns linearised about its own state."""
    own = found.inference.independent_copy(found)
    nothing = np.zeros(own.dictionary.width)
    state, values, settled = own.settle(
        own.nominal, nothing, there.members, there.sizes
    )
    search = Search(own.dictionary, own.gram(state, values, found.best))
    return search.evaluate(there.members, settled.sizes).score
