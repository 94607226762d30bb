"""Counter of samples in the device: unwraps it, and finds missing samples."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

LARGEST_LEAP = 1_000_000
"""Step of a counter beyond which it has restarted."""


class SampleCounter:
    """Follows a counter of samples that wraps at `span`."""

    def __init__(self, span: float = float("inf")) -> None:
        self._span = span
        self._last: float | None = None

    def steps(self, seq: Array) -> Array:
        """Periods since the sample before each, (n,); 1 if not known."""
        if not len(seq):
            return seq
        before = seq[0] - 1 if self._last is None else self._last
        steps = np.diff(seq, prepend=before)
        if np.isfinite(self._span):
            steps %= self._span
        self._last = float(seq[-1])
        return np.where(
            (steps >= 1) & (steps < min(LARGEST_LEAP, self._span / 2)), steps, 1.0
        )

    def link_broken(self) -> None:
        """Forget the last value: the link was interrupted."""
        self._last = None
