"""Finds still stretches of a recording without marks.

Runs of cells at rest (`rests`) must pass the test of a window, so that they contain no
sample of a turn.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.windows.cells import CELL, Between, CellRows, Cells, CellTable
from fieldcal.windows.dead_axis import LivingRows
from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.rests import SPAN, at_rest, table_of
from fieldcal.windows.spikes import without_spikes
from fieldcal.windows.verdict import judge

FEWEST = 3
"""Stretches below which rests may all have been too short for the usual margin."""

SEAM = 2 * CELL
"""Time that two parts of one rest are apart, s, if nothing was cut off them."""

_CLEARLY = 0.98
"""Ratio of departure to what is allowed that the sums of a recording must keep."""


def still_stretches(
    block: Block, min_seconds: float = 2.0
) -> list[tuple[float, float]]:
    """Find where the device was still, (start, end) in s of device time, in order.

    Every stretch lasts `min_seconds`, at least 1 s, and passes `average`.
    """

    def between(start: float, end: float) -> list[Block]:
        return [block.between(start, end)]

    block, cells = without_spikes(block), Cells()
    cells.add(block)
    table = cells.table
    return still_stretches_of_file(summary(table), table.origin, between, min_seconds)


def summary(cells: CellTable) -> Array:
    """Start of each cell, s, and its sums: (m, 35)."""
    return np.column_stack([cells.times, cells.sums])


def still_stretches_of_file(
    rows: CellRows, origin: Array, between: Between, min_seconds: float
) -> list[tuple[float, float]]:
    """`still_stretches` of a recording that does not fit into memory.

    Parameters
    ----------
    rows : of all of it
    origin : (6,) what their sums are taken about
    between : gives the samples of a stretch of it
    min_seconds : as in `still_stretches`

    """
    if len(rows) < 2 * SPAN:
        return []
    living = LivingRows(rows)
    rows, between = living, living.of(between)
    shortest = max(1.0, min_seconds)
    runs = at_rest(rows, StillnessLimits().noise)
    middles = [(r.first + SPAN // 2, r.last - 1 + SPAN // 2) for r in runs]
    goes_on = [i > 0 and runs[i - 1].last == r.first for i, r in enumerate(runs)]
    found = _joined(_passing_of(rows, origin, between, middles, shortest), goes_on)
    if len(found) >= FEWEST or len(runs) < FEWEST:
        return found
    # rests may all be short: then all that their spans saw, less a cell at each end
    ends = [run.last + SPAN - 2 for run in runs]
    nexts = [*(run.first for run in runs[1:]), len(rows)]
    whole = [
        (r.first + 1, min(e, n)) for r, e, n in zip(runs, ends, nexts, strict=True)
    ]
    short = _joined(_passing_of(rows, origin, between, whole, shortest), goes_on)
    return short if len(short) >= FEWEST else found


def _passing_of(
    rows: CellRows,
    origin: Array,
    between: Between,
    stretches: Sequence[tuple[int, int]],
    shortest: float,
) -> list[list[tuple[float, float]]]:
    """What passes of each stretch of cells [first, last)."""
    found: list[list[tuple[float, float]]] = []
    for first, last in stretches:
        cells = table_of(rows[first : last + 1], origin)
        if clear := _clear(table_of(rows[first:last], origin), shortest):
            found.append([clear])
        elif len(cells):
            start, end = float(cells.times[0]), float(cells.times[-1])
            found.append(_passing(between, start, end, shortest))
        else:
            found.append([])
    return found


def _joined(
    found: Sequence[Sequence[tuple[float, float]]], goes_on: Sequence[bool]
) -> list[tuple[float, float]]:
    """Stretches in order, those that only a seam divides as one.

    `goes_on` tells of each part of the recording whether the rest of the part before
    does: a long one is looked at in parts.
    """
    out: list[tuple[float, float]] = []
    for some, same in zip(found, goes_on, strict=True):
        rest = list(some)
        if same and out and rest and rest[0][0] - out[-1][1] < SEAM:
            out[-1] = (out[-1][0], rest.pop(0)[1])
        out += rest
    return out


def why_none(rows: CellRows, origin: Array) -> str:
    """Say why the calmest part of a recording without still stretches is none.

    Parameters
    ----------
    rows, origin : as in `still_stretches_of_file`

    """
    if len(rows) < 2 * SPAN:
        return f"it lasts less than {2 * SPAN * CELL:g} s"
    rows = LivingRows(rows)
    runs = at_rest(rows, StillnessLimits().noise)
    if not runs:
        return "nowhere is it calmer than elsewhere, or it turns all the time"
    longest = max(runs, key=lambda run: run.last - run.first)
    cells = table_of(rows[longest.first : longest.last + 1], origin)
    start, end = float(cells.times[0]), float(cells.times[-1])
    worst = judge(cells, StillnessLimits()).worst
    text = f"its calmest part, {start:.1f} to {end:.1f} s, "
    return text + (str(worst.error(start)) if worst.ratio > 1 else "is too short")


def _clear(cells: CellTable, shortest: float) -> tuple[float, float] | None:
    """Take a stretch by the sums of the recording, if its own would be the same.

    They are but for the step into its first sample; so it must pass clearly.
    """
    if not len(cells) or not cells.on_edge:
        return None
    first, last = cells.span
    if (
        last - first < shortest
        or judge(cells, StillnessLimits()).worst.ratio > _CLEARLY
    ):
        return None
    return first, float(np.nextafter(last, np.inf))


def _passing(
    between: Between, start: float, end: float, shortest: float
) -> list[tuple[float, float]]:
    """Parts of a stretch that pass as windows: it is cut where it was disturbed."""
    sums, times = Cells(), [np.nan, np.nan]
    for block in between(start, end):
        if len(block):
            sums.add(without_spikes(block))
            times = [np.fmin(times[0], block.t[0]), block.t[-1]]
    first, last = float(times[0]), float(times[1])
    if not last - first >= shortest:
        return []
    worst = judge(sums.table, StillnessLimits()).worst
    if worst.ratio <= 1:
        return [(first, float(np.nextafter(last, np.inf)))]
    # at an end of the stretch it is the last or the first sample that goes
    after = max(worst.at + worst.seconds, first + CELL)
    return [
        *_passing(between, start, min(worst.at, last), shortest),
        *_passing(between, max(after, start), end, shortest),
    ]
