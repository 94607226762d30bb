"""Counter of samples in the device: unwraps it, and finds missing samples."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

LARGEST_LEAP = 1_000_000
"""Step of a counter beyond which it has restarted."""


SURE_WRAPS = 8
"""Wraps in a row from and to the same numbers that tell how many a counter has."""


class SampleCounter:
    """Follows a counter of samples that wraps.

    Parameters
    ----------
    span : numbers that fit in
    states : numbers that it is said to have, if fewer; the span counts as soon as they
        span more
    wraps_anywhere : whether it may have fewer numbers than fit in, and nobody says how
        many: a wrap means a loss only once its largest number is known

    """

    def __init__(
        self,
        span: float = float("inf"),
        states: float | None = None,
        wraps_anywhere: bool = False,
    ) -> None:
        self._full, self._span = span, states or span
        self._least, self._most = float("inf"), float("-inf")
        self._last: float | None = None
        self._unsure = wraps_anywhere and span < float("inf")
        self._wrap, self._alike = (0.0, 0.0), 0
        self._stride = float("inf")

    def steps(self, seq: Array) -> Array:
        """Periods since the sample before each, (n,); 1 if not known."""
        if not len(seq):
            return seq
        before = seq[0] - 1 if self._last is None else self._last
        wraps = self._unsure_wraps(seq) if self._unsure else {}
        self._least = min(self._least, float(np.min(seq)))
        self._most = max(self._most, float(np.max(seq)))
        if self._most - self._least >= self._span:
            self._span = self._full
        steps = np.diff(seq, prepend=before)
        if np.isfinite(self._span):
            steps %= self._span
        steps[list(wraps)] = list(wraps.values())
        self._last = float(seq[-1])
        return np.where(
            (steps >= 1) & (steps < min(LARGEST_LEAP, self._span / 2)), steps, 1.0
        )

    def _unsure_wraps(self, seq: Array) -> dict[int, float]:
        """Periods at each wrap, by index, from what was seen before it only."""
        before = np.concatenate([[np.nan if self._last is None else self._last], seq])
        least = np.fmin.accumulate(np.append(self._least, seq))
        most = np.fmax.accumulate(np.append(self._most, seq))
        rise = np.diff(before)
        up = np.where(rise > 0, rise, np.inf)
        stride = np.fmin.accumulate(np.append(self._stride, up))
        self._stride = float(stride[-1])
        return {
            i: self._periods(before[i], seq[i], least[i + 1], most[i + 1], stride[i])
            for i in np.flatnonzero(rise < 0).tolist()
        }

    def _periods(
        self, a: float, b: float, least: float, most: float, stride: float
    ) -> float:
        """Periods from `a` to `b` behind a wrap.

        It has had numbers from `least` to `most`, and counted up by `stride` at least.
        """
        whole = float((b - a) % self._full)
        if most - least >= self._full - 1 or whole <= stride < np.inf:
            return whole
        if self._alike < SURE_WRAPS or self._wrap != (most, least):
            self._alike = self._alike + 1 if self._wrap == (a, b) else 1
            self._wrap = a, b
            return stride if stride < np.inf else 1.0
        return float((b - a) % (most - least + stride))

    def link_broken(self) -> None:
        """Forget the last value: the link was interrupted."""
        self._last = None
