"""Still stretches of a recording that nobody marked."""

from __future__ import annotations

import numpy as np

from fieldcal.samples import Array, Block
from fieldcal.windows.cells import CELL, Cells

_SPAN = 5
"""Cells to either side whose spread tells rest from motion."""


def still_stretches(
    block: Block, min_seconds: float = 2.0
) -> list[tuple[float, float]]:
    """Find the stretches, (start, end) in s of device time, in which it was still."""
    cells = Cells()
    cells.add(block)
    means = np.nan_to_num(cells.means)
    if len(means) <= 2 * _SPAN:
        return []
    view = np.lib.stride_tricks.sliding_window_view(means, 2 * _SPAN + 1, axis=0)
    spread = view.std(axis=-1)
    quiet = np.quantile(spread, 0.1, axis=0)
    ratio = (spread / np.where(quiet > 0, quiet, np.inf)).max(axis=1)
    return _runs(ratio < 6.0, cells.times[_SPAN:-_SPAN], min_seconds)


def _runs(still: Array, times: Array, shortest: float) -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    pairs = zip(edges[::2], edges[1::2], strict=True)
    found = [(float(times[a]), float(times[b - 1] + CELL)) for a, b in pairs]
    return [(a, b) for a, b in found if b - a >= shortest]
