"""The state of a set as it is reported: averaged over sizes.

The most probable size may mislead. If the rows hardly determine a calibration
parameter, its most probable size is the smallest, and that of an instability in few
windows is often zero. So calibration parameters have the prior of devices of their
kind, and the estimate is the mean over all instabilities (`mixture`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.evidence.sets import Set
from fieldcal.model.posterior.mixture import Mixing
from fieldcal.model.search.selection import Search


def average_over_sizes(search: Search, there: Set) -> Set:
    """A set with the mean and covariance of the mixture in its state."""
    wide, _ = search.with_typical_calibration(there)
    before = there.state
    state = Eliminated.of(before.rows, before.columns, wide)
    opened = replace(there, state=state)
    if len(np.unique(before.columns)) < len(before.columns) or not len(wide):
        return opened  # a column of two groups has one estimate for each
    mixing = Mixing(
        search.dictionary, search.gram, opened, search.typical_instability, False
    )
    found = mixing.run()
    half = np.linalg.cholesky(found.covariance).T
    state = replace(state, half=half, estimate=found.mean)
    return replace(there, state=state)
