"""A set as numbers are taken from it.

A size at its likeliest is no certainty: of a calibration that rows say little about it
is the smallest, and of few windows the likeliest instability is often none. Before the
rows a calibration is known as of devices of its kind, and what is said is the mean over
all instabilities (`mixture`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.mixture import Mixing
from fieldcal.model.search.selection import Search


def reported(search: Search, there: Set) -> Set:
    """A set with the mean and covariance of the mixture in its state."""
    wide, _ = search.opened(there)
    before = there.state
    state = Eliminated.of(before.rows, before.columns, wide)
    opened = replace(there, state=state)
    if len(np.unique(before.columns)) < len(before.columns) or not len(wide):
        return opened  # a column of two groups has one estimate for each
    mixing = Mixing(search.dictionary, search.gram, opened, search.unstable, False)
    found = mixing.run()
    half = np.linalg.cholesky(found.covariance).T
    state = replace(state, half=half, inverse=found.covariance, estimate=found.mean)
    return replace(there, state=state)
