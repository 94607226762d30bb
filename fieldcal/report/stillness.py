"""How still the device was: in each window, and all the way through.

    r = max over channels of sd(y over 1 s) / quietest tenth of that channel

y are means over 0.1 s. At rest r is about 1; a turn takes it to hundreds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.evaluation.usable_windows import UsableWindows
from fieldcal.evaluation.window_mean import table_rate, without_table_rotation
from fieldcal.report import blocks
from fieldcal.report.blocks import Cell, Figure, Section, Tone, table
from fieldcal.report.charts import Axis, Chart, ChartMark, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.recording import used_windows
from fieldcal.windows import StillnessLimits
from fieldcal.windows.cells import CELL, CellAccumulator, CellTable
from fieldcal.windows.verdict import judge_window

SPREAD_CELLS = 10
"""Cells whose spread is looked at: 1 s."""

POINTS = 4000
"""Most points of the line; the greatest of each group is kept."""

CLOSE_FRACTION = 0.8
"""Fraction of the limit above which a window is marked as close to it."""


def stillness_section(material: ReportMaterial) -> Section | None:
    """Motion over time, and how near each window came to being rejected."""
    cells = _cells(material.block)
    if len(cells) < 2 * SPREAD_CELLS:
        return None
    t, r = motion_by_second(cells)
    chart = Chart(
        "how-still",
        "Restlessness over device time",
        f"Restlessness from {r.min():.2g} to {r.max():.2g} times that of rest.",
        Axis(material.clock, "s"),
        Axis("spread over 1 s, times that of rest", log=True),
        (Series("restlessness", *_thinned(t - material.epoch, r), 1, "line"),),
        (ChartMark(1.0, "rest"),),
        used_windows(material),
    )
    caption = (
        "Spread of means over 0.1 s within 1 s, against the quietest tenth of the"
        " recording. Shaded: the windows."
    )
    parts: list[blocks.ReportBlock] = [Figure(chart, caption)]
    if material.windows is not None:
        parts.append(_windows(material, material.windows))
    found = [mark for mark in material.marks if mark.get("event") == "still"]
    if found:
        parts.append(_found_rests(material, found))
    return Section("stillness", "Stillness", tuple(parts))


def _found_rests(
    material: ReportMaterial, marks: Sequence[Mapping[str, Any]]
) -> blocks.Table:
    """Stretches at rest that an import found, with the reasons for their ends."""
    rows: list[list[str | Cell]] = [
        [
            str(i),
            f"{float(mark['start_s']) - material.epoch:.1f}",
            f"{float(mark['end_s']) - material.epoch:.1f}",
            str(mark["began"]),
            str(mark["ended"]),
            str(len(mark.get("without_s", ()))),
        ]
        for i, mark in enumerate(marks, 1)
    ]
    columns = ("", ">from, s", ">to, s", "before it", "behind it", ">bumps left out")
    return table("Still stretches that the import found", columns, rows)


def motion_by_second(cells: CellTable) -> tuple[Array, Array]:
    """Middle of each second, s, and r of it, (m,) each."""
    means = cells.steady_means
    view = np.lib.stride_tricks.sliding_window_view(means, SPREAD_CELLS, axis=0)
    spread = view.std(axis=-1)
    quiet = np.quantile(spread, 0.1, axis=0)
    ratio = spread / np.where(quiet > 0, quiet, np.inf)
    return cells.times[: len(ratio)] + SPREAD_CELLS * CELL / 2, ratio.max(axis=1)


def _thinned(t: Array, r: Array) -> tuple[Array, Array]:
    group = -(-len(t) // POINTS)
    first = np.arange(0, len(t), group)
    return t[first], np.maximum(np.maximum.reduceat(r, first), 1e-3)


def _cells(block: Block) -> CellTable:
    cells = CellAccumulator()
    cells.add(block)
    return cells.table


def _windows(material: ReportMaterial, still: UsableWindows) -> blocks.Table:
    rows: list[list[str | Cell]] = []
    for row, average in zip(still.position_numbers, still.averages, strict=True):
        end = float(np.nextafter(average.end, np.inf))
        window = material.block.between(average.start, end)
        about, span = material.session.about, (average.start, end)
        if about.positions[row].on_turning_table:
            rate = table_rate(material.block, span, about, row)
            window, _ = without_table_rotation(window, rate)
        worst = judge_window(_cells(window), StillnessLimits()).worst
        tone: Tone = (
            "bad" if worst.ratio > 1 else "warn" if worst.ratio > CLOSE_FRACTION else ""
        )
        share = Cell(f"{100 * worst.ratio:.0f} %", tone, min(1.0, worst.ratio))
        what = f"{worst.kind} on {CHANNELS[worst.channel]}"
        at = f"{worst.at - average.start:.1f}"
        rows.append([material.position_name(row), share, what, at])
    columns = ("position", ">of what is allowed", "nearest to", ">at, s into it")
    return table("What came nearest to disturbing each window", columns, rows)
