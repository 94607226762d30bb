"""The state of a set as it is reported: averaged over sizes.

The most probable size may underestimate the uncertainty. If the rows hardly determine a
calibration parameter, its most probable size is the smallest of the grid, and the most
probable instability in few windows is often zero. Therefore calibration parameters have
the prior of devices of their grade, and the estimate is the mean over all instabilities
(`mixture`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.model.evidence.eliminated import Eliminated
from fieldcal.model.evidence.sets import Set, Sets
from fieldcal.model.posterior.mixture import Mixing
from fieldcal.model.search.set_at_instability import with_typical_calibration


def average_over_sizes(sets: Sets, fitted: Set) -> Set:
    """A set with the mean and covariance of the mixture in its state."""
    prior_sigma, _ = with_typical_calibration(sets.dictionary, fitted)
    columns = fitted.state.columns
    state = Eliminated.of(fitted.state.rows, columns, prior_sigma)
    widened = replace(fitted, state=state)
    if len(np.unique(columns)) < len(columns) or not len(columns):
        return widened  # a column of two groups has one estimate for each
    mixture = Mixing(
        sets.dictionary, sets.gram, widened, sets.typical_instability, False
    ).run()
    half = np.linalg.cholesky(mixture.covariance).T
    state = replace(state, half=half, estimate=mixture.mean)
    return replace(fitted, state=state)
