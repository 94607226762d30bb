"""Parameters of the device in earlier calibrations and in this one."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration import COMPONENTS, Calibration, compare
from fieldcal.calibration.wording import (
    TITLES,
    format_unit,
    format_with_sigma,
    parameter_title,
)
from fieldcal.core.errors import InputError
from fieldcal.report.blocks import Cell, Figure, ReportBlock, Section, table
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.gather import EarlierCalibration, ReportMaterial


def history_section(material: ReportMaterial) -> Section | None:
    """Charts of each group over the calibrations; None without an earlier one."""
    now = material.calibration
    if now is None or not material.earlier:
        return None
    every = (*material.earlier, EarlierCalibration("now", now))
    blocks: list[ReportBlock] = []
    for group in COMPONENTS:
        if any(group in e.calibration.groups for e in every):
            blocks.append(
                Figure(_chart(group, every), "Change since the first; bars are ± 1σ.")
            )
    rows = _changes(material.earlier[-1], now)
    if rows:
        caption = f"Change since {material.earlier[-1].label}"
        blocks.append(
            table(caption, ("parameter", ">change ± 1σ", "unit", ">in σ"), rows)
        )
    return Section("history", "History of the device", tuple(blocks))


def _chart(group: str, every: tuple[EarlierCalibration, ...]) -> Chart:
    x = np.arange(len(every), dtype=float)
    series = []
    for i, axis in enumerate(COMPONENTS[group][0]):
        name = f"{group}.{axis}"
        value = np.array([e.calibration.value(name) for e in every])
        sigma = np.array([e.calibration.uncertainty(name) for e in every])
        known = value[np.isfinite(value)]
        if known.size:
            y = value - known[0]
            at = x + 0.1 * (i - 1)
            series.append(Series(axis, at, y, i + 1, "both", y - sigma, y + sigma))
    drift = max(float(np.nanmax(np.abs(s.y))) for s in series)
    unit = format_unit(COMPONENTS[group][1])
    return Chart(
        f"history-{group}",
        TITLES[group],
        f"{len(every)} calibrations; the largest change is {drift:.2g} {unit}.",
        Axis("calibration", names=tuple(e.label for e in every)),
        Axis("change", unit),
        tuple(series),
    )


def _changes(before: EarlierCalibration, now: Calibration) -> list[list[str | Cell]]:
    try:
        found = compare(now, before.calibration)
    except InputError:
        return []
    units = dict(zip(now.names, now.units, strict=True))
    return [
        [
            parameter_title(name),
            " ± ".join(format_with_sigma(float(d), float(s))),
            format_unit(units[name]),
            Cell(f"{z:+.1f}", "warn" if name in found.changed else ""),
        ]
        for name, d, s, z in zip(
            found.names, found.difference, found.sigma, found.z, strict=True
        )
    ]
