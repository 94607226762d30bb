"""Temperatures of a thermometer that is slower than the sensors beside it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fieldcal.core.samples import Array, Block


class Warmth:
    """Temperatures between the readings of a thermometer, and held beyond them.

    Attributes
    ----------
    within : samples between its first and its last reading

    """

    def __init__(self, blocks: Iterable[Block]) -> None:
        read = [(b.t, b.temperature) for b in blocks]
        t = np.concatenate([np.empty(0), *(one for one, _ in read)])
        warm = np.concatenate([np.empty(0), *(one for _, one in read)])
        known = np.isfinite(warm)
        self._t, self._warm = t[known], warm[known]
        self.within, self._before, self._behind = 0, 0.0, 0.0

    def at(self, t: Array) -> Array:
        """Temperatures (n,) at some times, deg C."""
        if not len(self._t):
            return np.full(len(t), np.nan)
        first, last = float(self._t[0]), float(self._t[-1])
        known = t[np.isfinite(t)]
        self.within += int(((known >= first) & (known <= last)).sum())
        if len(known):
            self._before = max(self._before, first - float(known.min()))
            self._behind = max(self._behind, float(known.max()) - last)
        found: Array = np.interp(t, self._t, self._warm)
        return found

    def span(self) -> str:
        """Its times, for messages."""
        if not len(self._t):
            return "of which none has a temperature"
        return f"{self._t[0]:.10g} to {self._t[-1]:.10g} s"

    def sentence(self) -> str:
        """Say how its readings became those of the samples."""
        usual = float(np.median(np.diff(self._t))) if len(self._t) > 1 else np.nan
        each = f", about {usual:.3g} s apart," if np.isfinite(usual) else ""
        text = f"its temperatures{each} are interpolated to the samples"
        if held := max(self._before, self._behind):
            text += f", and held up to {held:.3g} s before the first or behind the last"
        return text
