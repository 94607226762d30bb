"""Device counters of samples: unwrapped, and what they say is missing."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

FEW = 1_000_000
"""A counter that leaps by more than this has begun anew."""


class Sequence:
    """Follows a counter of samples that wraps at `span`."""

    def __init__(self, span: float = float("inf")) -> None:
        self._span = span
        self._last: float | None = None

    def steps(self, seq: Array) -> Array:
        """Periods since the sample before each, (n,); 1 where nothing is known."""
        if not len(seq):
            return seq
        before = seq[0] - 1 if self._last is None else self._last
        steps = np.diff(seq, prepend=before)
        if np.isfinite(self._span):
            steps %= self._span
        self._last = float(seq[-1])
        return np.where((steps >= 1) & (steps < min(FEW, self._span / 2)), steps, 1.0)

    def broken(self) -> None:
        """Forget the last one: the link was away."""
        self._last = None
