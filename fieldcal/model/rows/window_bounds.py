"""Bounds of each position's window, and of the blocks in it.

Blocks are a second long, and longer ones later in the window when there are many
seconds: what happens after a turn happens at the start.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fieldcal.core.samples import Array, Block, Index
from fieldcal.model import resolutions
from fieldcal.session.description import Description


def window_bounds(block: Block, about: Description) -> Index:
    """First and one past the last sample of each position's window, (p, 2).

    A session without positions is one window, the whole of it. A position without a
    window, or with one that no sample lies in, gets an empty span.
    """
    if not about.positions:
        return np.array([[0, len(block)]])
    ends = [w if w is not None else (np.inf, np.inf) for w in about.windows]
    return np.searchsorted(block.t, np.array(ends)).astype(np.intp)


def block_edges(start: float, end: float, windows: int) -> Array:
    """Edges of the blocks of a window, s: a second each, later ones longer if need be.

    >>> block_edges(0.0, 5.0, 9).tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    """
    length = end - start
    count = int(
        np.clip(
            resolutions.TARGET_ROWS // max(windows, 1),
            resolutions.MIN_WINDOW_ROWS,
            resolutions.MAX_WINDOW_ROWS,
        )
    )
    if length <= count * resolutions.FIRST_ROW_S:
        return np.linspace(
            start, end, max(1, round(length / resolutions.FIRST_ROW_S)) + 1
        )
    low, high = 1.0, 10.0
    for _ in range(60):
        ratio = (low + high) / 2
        longer = resolutions.FIRST_ROW_S * np.sum(ratio ** np.arange(count)) > length
        low, high = (low, ratio) if longer else (ratio, high)
    lengths = resolutions.FIRST_ROW_S * low ** np.arange(count)
    out = start + np.concatenate([[0.0], np.cumsum(lengths)])
    out[-1] = end
    return out


def block_bounds(
    t: Array,
    span: tuple[int, int],
    rate: float,
    windows: int,
    without: Iterable[tuple[float, float]] = (),
) -> Index:
    """First and one past the last sample of each block of a window, (k, 2).

    Parameters
    ----------
    t : (n,) times of all samples, s
    span : first and one past the last sample of the window
    rate : samples a second
    windows : how many there are
    without : spans excluded from windows, s: a block ends before, the next begins after

    """
    first, last = span
    start, end = float(t[first]), float(t[last - 1]) + 0.5 / rate
    gaps = np.array([gap for gap in without if start < gap[0] and gap[1] < end])
    gaps = gaps.reshape(-1, 2)
    grid = np.union1d(block_edges(start, end, windows), gaps)
    at = first + np.searchsorted(t[first:last], grid)
    keep = np.diff(at) > 0
    for a, b in gaps:
        keep &= (grid[1:] <= a) | (grid[:-1] >= b)
    return np.column_stack([at[:-1][keep], at[1:][keep]])
