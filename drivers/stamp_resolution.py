"""Resolution of stamps that nobody stated, by samples that share one.

Programs print seconds with two digits, also of 200 samples a second. Different samples
with one stamp are then no repetition. Their stamps are multiples of the resolution,
which is the least step between them.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

LEAST_SHARED, LEAST_SHARE = 8, 0.05
"""Least number and share of samples that share a stamp with the one before: fewer are
faults of a device."""


class StampResolution:
    """Looks at stamps until they are known to be coarse."""

    def __init__(self) -> None:
        self._last: Array = np.empty((0, 7))
        self._steps = self._shared = 0
        self._least = float("inf")

    def found(self, stamps: Array, six: Array) -> float:
        """Take samples that follow, s and SI; the resolution, s, 0 while unknown."""
        rows = np.vstack([self._last, np.column_stack([stamps, np.nan_to_num(six)])])
        self._last = rows[-1:]
        steps = np.diff(rows[:, 0])
        differ = (np.diff(rows[:, 1:], axis=0) != 0).any(axis=1)
        self._steps += len(steps)
        self._shared += int(np.count_nonzero((steps == 0) & differ))
        self._least = min(self._least, float(steps[steps > 0].min(initial=np.inf)))
        enough = max(LEAST_SHARED, LEAST_SHARE * self._steps)
        return self._least if self._shared >= enough and self._least < np.inf else 0.0
