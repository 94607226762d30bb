"""Windows cut into parts, and the means that they have.

A short window is cut where what fades after a turn still shows (at 10, 25 and 50 % of
its length), a long one into equal parts, so that a recording of one window has a
course.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block
from fieldcal.session.description import Description

SHORT_S = 45.0
EARLY = (0.0, 0.1, 0.25, 0.5, 1.0)
LONG_PARTS = 40
FEWEST = 3
"""Samples of the smallest part."""


@dataclass(frozen=True)
class Parts:
    """Parts of the windows, in the order of time.

    Attributes
    ----------
    rows : (m, 2) first and one past the last sample of each
    window : (m,) which window it belongs to
    t, temperature, since : (m,) means of time, deg C and s since the window began
    mean : (m, 6) outputs

    """

    rows: NDArray[np.intp]
    window: NDArray[np.intp]
    t: Array
    temperature: Array
    since: Array
    mean: Array

    @property
    def count(self) -> Array:
        """Samples of each."""
        return np.diff(self.rows, axis=1)[:, 0].astype(float)

    def of(self, samples: Array) -> Array:
        """Means of anything that samples have, (m, ...); nan is left out."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            return np.array([np.nanmean(samples[a:b], axis=0) for a, b in self.rows])


def windows_of(block: Block, about: Description) -> NDArray[np.intp]:
    """First and one past the last sample of each window, (w, 2), in session order."""
    spans = [w for w in about.windows if w is not None]
    return np.searchsorted(block.t, np.array(spans)).astype(np.intp)


def cut(block: Block, about: Description) -> Parts:
    """Cut the windows of a session into parts."""
    rows: list[tuple[int, int]] = []
    window: list[int] = []
    windows = windows_of(block, about)
    for w, (a, b) in enumerate(windows):
        long = block.t[b - 1] - block.t[a]
        shares = np.linspace(0, 1, LONG_PARTS + 1) if long > SHORT_S else EARLY
        edges = np.searchsorted(block.t[a:b], block.t[a] + long * np.array(shares)) + a
        edges[-1] = b
        for first, last in zip(edges[:-1], edges[1:], strict=True):
            if last - first >= FEWEST:
                rows.append((int(first), int(last)))
                window.append(w)
    table, of_window = np.array(rows), np.array(window)
    nothing = np.full(len(table), np.nan)
    bare = Parts(table, of_window, nothing, nothing, nothing, nothing)
    t = bare.of(block.t)
    began = block.t[windows[of_window, 0]]
    degrees = bare.of(block.temperature)
    return Parts(table, of_window, t, degrees, t - began, bare.of(block.six))
