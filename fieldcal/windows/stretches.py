"""Finds still stretches of a recording without marks.

Runs of cells at rest (`rests`) must pass the test of a window, so that they contain no
sample of a turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.windows.cells import (
    CELL,
    CellAccumulator,
    CellRows,
    CellTable,
    SamplesBetween,
)
from fieldcal.windows.dead_axis import LiveAxisRows
from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.rests import SPREAD_CELLS, cell_table, find_rest_runs
from fieldcal.windows.spikes import without_spikes
from fieldcal.windows.verdict import FEWEST_JUDGED_CELLS, judge_window
from fieldcal.windows.window import FEWEST_CELLS

MIN_STRETCHES = 3
"""Number of stretches below which the rests may be too short to omit half a second at
each end."""

SEAM_S = 2 * CELL
"""Largest gap between two parts of one rest that are evaluated separately, s."""

TESTED_S = FEWEST_JUDGED_CELLS * CELL + CELL
"""Least time after a step that is a stretch of its own, s: long enough to be tested."""

_CLEARLY = 0.98
"""Largest ratio of departure to the allowed one for a pass without reading samples."""


def still_stretches(
    block: Block, min_seconds: float = 2.0
) -> list[tuple[float, float]]:
    """Find where the device was still, (start, end) in s of device time, in order.

    Every stretch lasts `min_seconds`, at least 1 s, and passes `average`.
    """

    def between(start: float, end: float) -> list[Block]:
        return [block.between(start, end)]

    block, cells = without_spikes(block), CellAccumulator()
    cells.add(block)
    table = cells.table
    return still_stretches_of_file(cell_rows(table), table.origin, between, min_seconds)


def calm_parts(
    between: SamplesBetween, span: tuple[float, float], min_seconds: float
) -> list[tuple[float, float]]:
    """Parts of a position that pass the test of a window; all of it if none does.

    A device that is nudged while it is held has two attitudes in one position.

    Parameters
    ----------
    between : gives the samples of a stretch of the recording
    span : first and last instant of the position, s
    min_seconds : as in `still_stretches`

    """
    start, end = span
    after = float(np.nextafter(end, np.inf))
    parts = _passing_parts(between, start, after, max(1.0, min_seconds))
    return [span] if not parts or parts == [(start, after)] else parts


def cell_rows(cells: CellTable) -> Array:
    """Start of each cell, s, and its sums: (m, 35)."""
    return np.column_stack([cells.times, cells.sums])


def still_stretches_of_file(
    rows: CellRows, origin: Array, between: SamplesBetween, min_seconds: float
) -> list[tuple[float, float]]:
    """`still_stretches` of a recording that does not fit into memory.

    Parameters
    ----------
    rows : of all of it
    origin : (6,) reference of their sums
    between : gives the samples of a stretch of it
    min_seconds : as in `still_stretches`

    """
    if len(rows) < 2 * SPREAD_CELLS:
        return []
    living = LiveAxisRows(rows)
    rows, between = living, living.samples_without_dead_axes(between)
    shortest = max(1.0, min_seconds)
    runs = find_rest_runs(rows, StillnessLimits().noise)
    middles = [
        (r.first + SPREAD_CELLS // 2, r.last - 1 + SPREAD_CELLS // 2) for r in runs
    ]
    goes_on = [i > 0 and runs[i - 1].last == r.first for i, r in enumerate(runs)]
    joined = _join_at_seams(
        _passing_parts_of_stretches(rows, origin, between, middles, shortest), goes_on
    )
    if len(joined) >= MIN_STRETCHES or len(runs) < MIN_STRETCHES:
        return joined
    # rests may all be short: use the whole of their spans, less a cell at each end
    ends = [run.last + SPREAD_CELLS - 2 for run in runs]
    nexts = [*(run.first for run in runs[1:]), len(rows)]
    whole = [
        (r.first + 1, min(e, n)) for r, e, n in zip(runs, ends, nexts, strict=True)
    ]
    short = _join_at_seams(
        _passing_parts_of_stretches(rows, origin, between, whole, shortest), goes_on
    )
    return short if len(short) >= MIN_STRETCHES else joined


def _passing_parts_of_stretches(
    rows: CellRows,
    origin: Array,
    between: SamplesBetween,
    stretches: Sequence[tuple[int, int]],
    shortest: float,
) -> list[list[tuple[float, float]]]:
    """Parts of each stretch of cells [first, last) that pass the test of a window."""
    passing: list[list[tuple[float, float]]] = []
    for first, last in stretches:
        cells = cell_table(rows[first : last + 1], origin)
        if clear := _passes_clearly(cell_table(rows[first:last], origin), shortest):
            passing.append([clear])
        elif len(cells):
            start, end = float(cells.times[0]), float(cells.times[-1])
            passing.append(_passing_parts(between, start, end, shortest))
        else:
            passing.append([])
    return passing


def _join_at_seams(
    stretches_of_parts: Sequence[Sequence[tuple[float, float]]], goes_on: Sequence[bool]
) -> list[tuple[float, float]]:
    """Stretches in order; those divided only by a seam are joined.

    A long rest is evaluated in parts. `goes_on` says of each part whether it continues
    the rest of the part before.
    """
    out: list[tuple[float, float]] = []
    for part, same in zip(stretches_of_parts, goes_on, strict=True):
        rest = list(part)
        if same and out and rest and rest[0][0] - out[-1][1] < SEAM_S:
            out[-1] = (out[-1][0], rest.pop(0)[1])
        out += rest
    return out


def explain_no_stretch(rows: CellRows, origin: Array) -> str:
    """Say why the calmest part of a recording is no still stretch.

    Parameters
    ----------
    rows, origin : as in `still_stretches_of_file`

    """
    if len(rows) < 2 * SPREAD_CELLS:
        return _explain_few_cells(rows)
    rows = LiveAxisRows(rows)
    runs = find_rest_runs(rows, StillnessLimits().noise)
    if not runs:
        return (
            "nowhere is it calmer than elsewhere for a second, or it turns all the time"
        )
    longest = max(runs, key=lambda run: run.last - run.first)
    cells = cell_table(rows[longest.first : longest.last + 1], origin)
    start, end = float(cells.times[0]), float(cells.times[-1])
    worst = judge_window(cells, StillnessLimits()).worst
    text = f"its calmest part, {start:.1f} to {end:.1f} s, "
    return text + (str(worst.as_error(start)) if worst.ratio > 1 else "is too short")


def _explain_few_cells(rows: CellRows) -> str:
    """Say of a recording with few cells whether it is short or its samples are rare."""
    least = 2 * SPREAD_CELLS
    starts = rows[: len(rows)][:, 0]
    if len(starts) and starts[-1] - starts[0] >= least * CELL:
        return (
            f"its samples are too rare: they lie in {len(starts)} tenths of a second,"
            f" and {least} are needed"
        )
    return f"it lasts less than {least * CELL:g} s"


def _passes_clearly(cells: CellTable, shortest: float) -> tuple[float, float] | None:
    """Test a stretch by the cell sums of the recording; None if that is not possible.

    These differ from sums of the stretch alone by the step into its first sample, so
    the test must be passed clearly.
    """
    if not len(cells) or not cells.starts_on_edge:
        return None
    first, last = cells.span
    if (
        last - first < shortest
        or len(cells) < FEWEST_CELLS
        or judge_window(cells, StillnessLimits()).worst.ratio > _CLEARLY
    ):
        return None
    return first, float(np.nextafter(last, np.inf))


def _level_change(cells: CellTable, channel: int) -> float | None:
    """Instant, s, at which a channel that seems to drift changed its level; or None.

    A nudge amid a stretch looks like a drift over all of it. It is one if two levels
    leave less of the cell means than a line does.
    """
    y = cells.steady_means[: cells.complete_count, channel]
    t = np.arange(len(y))
    known = np.isfinite(y)
    y, t = y[known], t[known]
    if len(y) < 2 * FEWEST_CELLS:
        return None
    left = y - np.polyval(np.polyfit(t, y, 1), t)
    many = np.arange(1, len(y))
    first, all_of_it = np.cumsum(y)[:-1], y.sum()
    # what two levels explain of the squares
    levels = first**2 / many + (all_of_it - first) ** 2 / (len(y) - many)
    at = int(np.argmax(levels))
    if (y @ y) - levels[at] >= left @ left:
        return None
    return float(cells.times[t[at + 1]])


def _passing_parts(
    between: SamplesBetween, start: float, end: float, shortest: float
) -> list[tuple[float, float]]:
    """Parts of a stretch that pass as windows: it is cut where it was disturbed."""
    sums, times = CellAccumulator(), [np.nan, np.nan]
    for block in between(start, end):
        if len(block):
            sums.add(without_spikes(block))
            times = [np.fmin(times[0], block.t[0]), block.t[-1]]
    first, last = float(times[0]), float(times[1])
    if not last - first >= shortest or len(sums.table) < FEWEST_CELLS:
        return []
    worst = judge_window(sums.table, StillnessLimits()).worst
    if worst.ratio <= 1:
        return [(first, float(np.nextafter(last, np.inf)))]
    over = worst.at + worst.seconds
    if worst.kind == "drift":
        at = _level_change(sums.table, worst.channel)
        if at is None:
            return []
        # the cell before or behind may hold samples of both levels
        worst, over = replace(worst, at=at - CELL), at + CELL
    if worst.kind == "step" and last - worst.at > TESTED_S:
        over = worst.at + CELL  # its seconds are those of the means that show it
    # at an end of the stretch the last or the first sample is removed
    after = max(over, first + CELL)
    return [
        *_passing_parts(between, start, min(worst.at, last), shortest),
        *_passing_parts(between, max(after, start), end, shortest),
    ]
