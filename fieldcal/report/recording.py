"""The raw recording, zoomable, and the averages that were taken from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration.wording import format_with_sigma
from fieldcal.core.samples import CHANNELS, Array
from fieldcal.evaluation.usable_windows import UsableWindows
from fieldcal.report.blocks import Figure, Paragraph, ReportBlock, Section, Table, table
from fieldcal.report.charts import SENSORS, ChartMark, LabelledSpan, RecordingChart
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.loose import Json, number_or_nan, objects_at
from fieldcal.report.packing import ChannelTable, pack, stretches_around

EDGE_STRETCH_S = 3.0
"""Stretch about each edge of a window that is packed sample by sample, s."""

BRIEF = 5.0
"""A mismatch shorter than this is marked where it begins, s."""

MOST_MARKS = 30

EVENTS = {
    "rejected": "window rejected",
    "kept": "disturbed",
    "wrong": "wrong place",
    "failed": "failed",
    "interrupted": "interrupted",
    "clock_step": "clock set",
}


def recording_section(material: ReportMaterial) -> Section:
    """All channels over device time, with the windows and their averages."""
    chart = _chart(material)
    blocks: list[ReportBlock] = [
        Figure(
            chart,
            "Shaded: the windows that were averaged, with a line at the average. Drag"
            " to zoom in on a stretch; each panel then fits what is seen.",
        )
    ]
    if material.windows is not None:
        blocks += averages_tables(material, material.windows)
    if material.windows_error:
        blocks.append(
            Paragraph(f"No window could be averaged: {material.windows_error}.")
        )
    return Section("recording", "Recording", tuple(blocks))


def used_windows(material: ReportMaterial) -> tuple[LabelledSpan, ...]:
    """The windows that were averaged, with the number of their position."""
    if material.windows is None:
        return ()
    pairs = zip(
        material.windows.position_numbers, material.windows.averages, strict=True
    )
    off = material.epoch
    return tuple(
        LabelledSpan(a.start - off, a.end - off, str(row + 1)) for row, a in pairs
    )


def _chart(material: ReportMaterial) -> RecordingChart:
    block = material.block
    six = block.six
    panels = [
        (name, "m/s²" if i < 3 else "rad/s", i % 3 + 1)
        for i, name in enumerate(CHANNELS)
        if np.isfinite(six[:, i]).any()
    ]
    used = [i for i in range(6) if np.isfinite(six[:, i]).any()]
    values = six[:, used]
    if np.isfinite(block.temperature).any():
        panels.append(("temperature", "°C", 4))
        values = np.column_stack([values, block.temperature])
    spans, marks = used_windows(material), _marks(material)
    edges = [m.at for m in marks] + [e for s in spans for e in (s.start, s.end)]
    return RecordingChart(
        "record",
        "Samples over device time",
        _alt(panels, values, float(block.t[-1] - block.t[0]), spans),
        tuple(panels),
        material.clock,
        pack(
            ChannelTable(block.t - material.epoch, values),
            stretches_around(edges, EDGE_STRETCH_S),
        ),
        spans,
        _means(material, used, values.shape[1]),
        marks,
    )


def _means(material: ReportMaterial, used: Sequence[int], panels: int) -> Array:
    """Averages of the windows, (windows, panels)."""
    averages = material.windows.averages if material.windows is not None else ()
    rows = [[*(a.mean[i] for i in used), a.temperature] for a in averages]
    return np.array(rows, dtype=float).reshape(len(rows), len(used) + 1)[:, :panels]


def _marks(material: ReportMaterial) -> tuple[ChartMark, ...]:
    """Events with a device time, and disturbances that a diagnosis found."""
    marks = [
        ChartMark(float(m["at_s"]) - material.epoch, EVENTS[m["event"]])
        for m in material.marks
        if m.get("event") in EVENTS and isinstance(m.get("at_s"), int | float)
    ]
    return (*marks, *_transients(material.diagnosis or {}, material.epoch))


def _transients(diagnosis: Json, epoch: float) -> list[ChartMark]:
    found: dict[float, list[str]] = {}
    for m in objects_at(diagnosis, "mismatch"):
        at = number_or_nan(m.get("from_s"))
        brief = number_or_nan(m.get("to_s")) - at < BRIEF
        if m.get("kind") in ("samples", "transient") and brief:
            found.setdefault(round(at - epoch, 1), []).append(str(m.get("channel", "")))
    return [ChartMark(at, ", ".join(names)) for at, names in found.items()][:MOST_MARKS]


def _alt(
    panels: Sequence[tuple[str, str, int]],
    values: Array,
    seconds: float,
    spans: Sequence[LabelledSpan],
) -> str:
    ranges = [
        f"{name} from {np.nanmin(v):.4g} to {np.nanmax(v):.4g} {unit}"
        for (name, unit, _), v in zip(panels, values.T, strict=True)
    ]
    return f"{seconds:.0f} s of samples, {len(spans)} windows: {'; '.join(ranges)}."


def averages_tables(material: ReportMaterial, still: UsableWindows) -> list[Table]:
    """Tables of the mean of each window with its standard error, one per sensor."""
    out = []
    for first, sensor, unit in SENSORS:
        channels = [
            i
            for i in range(first, first + 3)
            if any(np.isfinite(a.mean[i]) for a in still.averages)
        ]
        if not channels:
            continue
        columns = ["position", *(f">{CHANNELS[i]}, {unit}" for i in channels)]
        columns += [">from – to, s", ">samples", ">°C"]
        rows = [
            [
                material.position_name(row),
                *(
                    " ± ".join(format_with_sigma(a.mean[i], a.sigma[i]))
                    for i in channels
                ),
                f"{a.start:.1f} – {a.end:.1f}",
                f"{a.n:,}",
                f"{a.temperature:.2f}" if np.isfinite(a.temperature) else "–",
            ]
            for row, a in zip(still.position_numbers, still.averages, strict=True)
        ]
        caption = f"Averages of the {sensor}, with standard errors"
        out.append(table(caption, columns, rows))
    return out
