"""Page of a lot: spread of the units, odd units, shifts and control charts."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.fleet.capability import LotParameter
from fieldcal.fleet.control import ControlChart
from fieldcal.fleet.lot import LotAnalysis, untimed_sentence
from fieldcal.report.blocks import (
    Cell,
    Figure,
    NameValues,
    Paragraph,
    ReportBlock,
    Section,
    Table,
    Tone,
    table,
)
from fieldcal.report.charts import Axis, Chart, ChartMark, Series
from fieldcal.report.overview import PageHeader
from fieldcal.report.page import render_page


def render_lot_page(found: LotAnalysis, query: str) -> str:
    """Render the analysis of a lot as HTML; `query` names the lot."""
    share, low, high = (100 * part for part in found.yield_share)
    facts = NameValues(
        (
            ("units", f"{len(found.units)}"),
            ("sessions", f"{found.sessions}"),
            ("without a result", f"{found.failed}"),
            ("yield", f"{share:.1f} % (95 %: {low:.1f} to {high:.1f} %)"),
        )
    )
    rate = 100 * found.false_discovery_rate
    says = (
        "Spreads are those of the units, with the uncertainty of each taken off; of a"
        f" unit the last good session counts. Among odd units {rate:.3g} %"
        " are expected to be false."
    )
    top = PageHeader(
        query, "", _verdict(found), "good" if found.in_control else "warn", says,
        facts, "IMUs of a lot",
    )  # fmt: skip
    return render_page(
        top,
        [
            Section("odd", "Odd units", (_odd(found),)),
            Section("shifts", "What has shifted", tuple(_shifts(found))),
            Section("spread", "Spread and capability", (_spreads(found),)),
            Section(
                "values",
                "Units",
                tuple(_values(found, one) for one in found.parameters.values()),
            ),
            Section("control", "Control charts", tuple(_control(found))),
        ],
    )


def _verdict(found: LotAnalysis) -> str:
    """Headline of the page, and its tone."""
    if found.in_control:
        return "in control"
    shifted = {(one.parameter, one.level) for one in found.shifts}
    counts = (
        (len(found.odd), "odd unit"),
        (len(shifted), "shift"),
        (len(found.alarms), "drift"),
    )
    return ", ".join(f"{n} {what}{'s' * (n > 1)}" for n, what in counts if n)


def _odd(found: LotAnalysis) -> Table | Paragraph:
    if not found.odd:
        return Paragraph("No unit is out of family.")
    rows = []
    for one in found.odd:
        off = " ± ".join(format_with_sigma(one.deviation, one.sigma))
        unit = format_unit(found.parameters[one.parameter].unit)
        rows.append(
            [one.serial, one.parameter, off, unit, f"{one.probability:.1g}", one.folder]
        )
    columns = ("unit", "parameter", ">off by", "", ">chance", "session")
    return table("Out of family, by the oddest parameter", columns, rows)


def _shifts(found: LotAnalysis) -> list[ReportBlock]:
    rows: list[list[str | Cell]] = []
    for one in found.shifts:
        unit = format_unit(found.parameters[one.parameter].unit)
        for label, value, sigma in zip(one.labels, one.values, one.sigmas, strict=True):
            shown = " ± ".join(format_with_sigma(float(value), float(sigma)))
            tone: Tone = "warn" if abs(value) > 3 * sigma else ""
            rows.append(
                [one.parameter, one.level, label, Cell(shown, tone), unit,
                 f"{one.probability:.2f}"]
            )  # fmt: skip
    for alarm in found.alarms:
        rows.append([alarm.parameter, f"time, {alarm.chart}", alarm.at, "", "", ""])
    if not rows:
        return [Paragraph("Nothing differs by lot, station or operator, or drifts.")]
    columns = ("parameter", "by", "group", ">shift", "", ">probability")
    return [table("Against the mean of all", columns, rows)]


def _spreads(found: LotAnalysis) -> Table:
    rows = []
    for one in found.parameters.values():
        about = one.distribution
        cp = "" if one.cp is None else f"{one.cp:.2f} ± {one.cp_sigma:.2f}"
        cpk = "" if one.cpk is None else f"{one.cpk:.2f} ± {one.cpk_sigma:.2f}"
        rows.append(
            [
                one.name,
                f"{len(one.x)}",
                " ± ".join(format_with_sigma(about.mean, about.mean_sigma)),
                f"{about.spread:.2g}",
                f"{about.low:.2g} to {about.high:.2g}",
                f"{np.median(one.sigma):.2g}",
                format_unit(one.unit),
                "" if one.tolerance is None else f"{one.tolerance:.3g}",
                cp,
                cpk,
            ]
        )
    columns = (
        *("parameter", ">units", ">mean", ">spread", ">95 %", ">± of a unit", "unit"),
        *(">tolerance", ">Cp", ">Cpk"),
    )
    return table("Process capability", columns, rows)


def _values(found: LotAnalysis, one: LotParameter) -> Figure:
    """Units in the order of time, with their own ±."""
    about, unit = one.distribution, format_unit(one.unit)
    at = np.arange(len(one.x), dtype=float)
    seen = Series(
        one.name, at, one.x, 1, "points", one.x - one.sigma, one.x + one.sigma
    )
    levels = [ChartMark(about.mean, "mean")]
    levels += [
        ChartMark(about.mean + s * about.spread, f"{s:+d} spreads") for s in (-3, 3)
    ]
    alt = (
        f"{len(one.x)} units; mean {about.mean:.4g}, spread {about.spread:.2g} {unit}."
    )
    chart = Chart(
        f"values-{one.name}", one.name, alt, _units(found, one),
        Axis("value", unit), (seen,), tuple(levels),
    )  # fmt: skip
    return Figure(chart, "Bars are each unit's own ± 1σ.")


def _units(found: LotAnalysis, one: LotParameter, first: int = 0) -> Axis:
    """Serial numbers of the units that have a parameter, from the `first` one."""
    numbers = one.unit_numbers.tolist()[first:]
    serials = tuple(found.units[i].serial for i in numbers)
    return Axis("unit, in order of time", names=serials)


def _control(found: LotAnalysis) -> list[ReportBlock]:
    out: list[ReportBlock] = [
        Paragraph(
            "Of standardised values; the limits are such that 5 of 100 lots in control"
            " have an alarm on any chart."
        )
    ]
    if found.untimed:
        out.append(Paragraph(untimed_sentence(found)))
    for one in found.parameters.values():
        for chart in one.charts:
            out.append(Figure(_chart(found, one, chart), ""))
    return out


def _chart(found: LotAnalysis, one: LotParameter, chart: ControlChart) -> Chart:
    at = np.arange(len(chart.values), dtype=float)
    limits = [
        Series(f"limit {sign:+d}", at, sign * chart.limit, 2, "line")
        for sign in (1, -1)
    ]
    seen = Series(chart.name, at, chart.values, 1, "both")
    said = (
        "in control"
        if chart.alarm is None
        else f"beyond its limits from unit {chart.alarm + 1}"
    )
    name = f"{chart.name}, {one.name}"
    return Chart(
        f"{chart.name}-{one.name}", name, f"{name}: {said}.",
        _units(found, one, one.untimed), Axis(chart.name, "σ"), (seen, *limits),
    )  # fmt: skip
