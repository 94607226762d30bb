"""Counter of samples in the device: unwraps it, and finds missing samples."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

LARGEST_LEAP = 1_000_000
"""Step of a counter beyond which it has restarted."""


class SampleCounter:
    """Follows a counter of samples that wraps.

    Parameters
    ----------
    span : numbers that fit in
    states : numbers that it is said to have, if fewer; the span counts as soon as they
        span more

    """

    def __init__(self, span: float = float("inf"), states: float | None = None) -> None:
        self._full, self._span = span, states or span
        self._least, self._most = float("inf"), float("-inf")
        self._last: float | None = None

    def steps(self, seq: Array) -> Array:
        """Periods since the sample before each, (n,); 1 if not known."""
        if not len(seq):
            return seq
        self._least = min(self._least, float(np.min(seq)))
        self._most = max(self._most, float(np.max(seq)))
        if self._most - self._least >= self._span:
            self._span = self._full
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
