"""Positions of the device: stated angles, and angles that accelerometers measure."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.wording import format_with_sigma
from fieldcal.core.frames import wrap_angle
from fieldcal.report.blocks import Figure, ReportBlock, Section, Table, table
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.residuals import MeasuredAngles, measured_angles


def positions_section(material: ReportMaterial) -> Section | None:
    """A chart of the positions in alpha and beta, and the angles with their ±."""
    where = measured_angles(material)
    if where is None:
        return None
    blocks: list[ReportBlock] = [Figure(_chart(where), _caption(where, material))]
    if np.isfinite(where.stated).any():
        blocks.append(Figure(_misses(where), "Angle shown less angle asked for."))
    blocks.append(_table(where, material))
    return Section("positions", "Where the device was", tuple(blocks))


def _caption(where: MeasuredAngles, material: ReportMaterial) -> str:
    said = "Angles by the accelerometers"
    by = "calibrated" if material.calibration is not None else "nominal calibration"
    if np.isfinite(where.stated).any():
        return f"{said} ({by}). They include the tilt of the base."
    return f"{said} ({by}); no angles were asked for, so they serve to see the spread."


def _chart(where: MeasuredAngles) -> Chart:
    series = [
        Series("shown", where.measured[:, 0], where.measured[:, 1], 1),
    ]
    known = np.isfinite(where.stated).all(axis=1)
    if known.any():
        asked = where.stated[known]
        series.insert(0, Series("asked for", asked[:, 0], asked[:, 1], 6))
    listed = ", ".join(f"({a:.1f}°, {b:.1f}°)" for a, b in where.measured)
    return Chart(
        "places",
        "Positions in α and β",
        f"{len(where.rows)} positions, α and β shown: {listed}.",
        Axis("α", "deg"),
        Axis("β", "deg"),
        tuple(series),
    )


def _misses(where: MeasuredAngles) -> Chart:
    off = wrap_angle(where.measured - where.stated, 360.0)
    x = np.arange(len(where.rows), dtype=float)
    series = tuple(
        Series(
            name,
            x + 0.12 * (2 * i - 1),
            off[:, i],
            i + 1,
            low=off[:, i] - where.sigma[:, i],
            high=off[:, i] + where.sigma[:, i],
        )
        for i, name in enumerate(("α", "β"))
    )
    worst = float(np.nanmax(np.abs(off)))
    return Chart(
        "misses",
        "Shown less asked",
        f"The largest difference between an angle shown and asked for is {worst:.3f}°.",
        Axis("position", names=tuple(str(r + 1) for r in where.rows)),
        Axis("shown less asked", "deg"),
        series,
    )


def _table(where: MeasuredAngles, material: ReportMaterial) -> Table:
    rows = []
    for row, asked, shown, sigma in zip(
        where.rows, where.stated, where.measured, where.sigma, strict=True
    ):
        cells = [material.position_name(row)]
        cells += [f"{a:g}" if np.isfinite(a) else "–" for a in asked]
        for value, error in zip(shown, sigma, strict=True):
            cells.append(" ± ".join(format_with_sigma(value, error)))
        rows.append(cells)
    columns = ("position", ">α asked", ">β asked", ">α shown", ">β shown")
    return table("Angles in degrees; ± is one standard uncertainty", columns, rows)
