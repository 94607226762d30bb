"""Page of a lot: spread of the units, odd units, shifts and control charts."""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.fleet.capability import LotParameter
from fieldcal.fleet.control import ControlChart
from fieldcal.fleet.lot import (
    LotAnalysis,
    serials_sentence,
    untimed_sentence,
)
from fieldcal.fleet.lot_yield import yield_sentence
from fieldcal.fleet.units import unit_name
from fieldcal.report.blocks import (
    Cell,
    Collapsible,
    Figure,
    NameValues,
    Paragraph,
    ReportBlock,
    Section,
    Table,
    Tone,
    WarningBox,
    table,
)
from fieldcal.report.charts import Axis, Chart, ChartMark, Series
from fieldcal.report.overview import PageHeader
from fieldcal.report.page import render_page

CAPABLE = 1.33
"""Cpk that is usually asked of a process, four standard deviations to the limit."""

CPK = (
    "Cpk is how many times three spreads fit between the mean of the lot and the nearer"
    f" limit of the tolerance. Usually {CAPABLE} is asked for; marked is what may be"
    " less, by the upper end of the 95 % interval of the spread. If only the spread is"
    " too large (Cp is low as well), choose among units or widen the tolerance; if Cp"
    " is high and Cpk low, the mean is off, and one correction for all units helps."
)

ODD = (
    "Chance: how probable it is that a unit like the others is as odd as this. Measure"
    " each again, on another station if there is one. A unit that is odd again is to be"
    " kept out; one that is not had a bad session."
)

SHIFTS = (
    "A shift by station or operator is one of the measurement: check level, angles and"
    " fixture there before units are judged. A shift by lot or model is one of the"
    " parts. A drift is a change in time: see its control chart."
)

CHARTS = (
    "Each unit's deviation from the mean of the lot, in its own standard deviations:"
    " EWMA is the average of about the last twenty units, CUSUM the sum of what is"
    " beyond a quarter of one. The limits are such that 5 of 100 lots in control have"
    " an alarm on any chart."
)


def render_lot_page(found: LotAnalysis, query: str) -> str:
    """Render the analysis of a lot as HTML; `query` names the lot."""
    facts = NameValues(
        (
            ("units with a good result", f"{len(found.units)}"),
            ("sessions", f"{found.sessions}"),
            ("sessions without a result", f"{found.failed}"),
            ("yield", yield_sentence(found)),
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
            Section("odd", "Odd units", tuple(_odd(found))),
            Section("shifts", "What has shifted", tuple(_shifts(found))),
            Section(
                "spread", "Spread and capability", (Paragraph(CPK), _spreads(found))
            ),
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
        (len({one.parameter for one in found.alarms}), "drift"),
    )
    return ", ".join(f"{n} {what}{'s' * (n > 1)}" for n, what in counts if n)


def _odd(found: LotAnalysis) -> list[ReportBlock]:
    alike = serials_sentence(found)
    notes: list[ReportBlock] = [WarningBox(alike)] if alike else []
    if not found.odd:
        return [*notes, Paragraph("No unit is out of family.")]
    rows = []
    for one in found.odd:
        off = " ± ".join(format_with_sigma(one.deviation, one.sigma))
        unit = format_unit(found.parameters[one.parameter].unit)
        rows.append(
            [
                one.serial or "no serial number", one.parameter, off, unit,
                f"{one.probability:.1g}", one.folder,
            ]
        )  # fmt: skip
    columns = ("unit", "parameter", ">off by", "", ">chance", "session")
    return [
        *notes,
        table("Out of family, by the oddest parameter", columns, rows),
        Paragraph(ODD),
    ]


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
        rows.append(
            [alarm.parameter, f"time, {alarm.chart}", f"from about {alarm.since} on",
             "", "", ""]
        )  # fmt: skip
    if not rows:
        return [Paragraph("Nothing differs by lot, station or operator, or drifts.")]
    columns = ("parameter", "by", "group", ">shift", "", ">probability")
    return [table("Against the mean of all", columns, rows), Paragraph(SHIFTS)]


def _spreads(found: LotAnalysis) -> Table:
    rows: list[list[str | Cell]] = []
    for one in found.parameters.values():
        about = one.distribution
        cp = "" if one.cp is None else f"{one.cp:.2f} ± {one.cp_sigma:.2f}"
        least = one.cpk_at_least
        tone: Tone = "warn" if least is not None and least < CAPABLE else ""
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
                Cell(one.cpk_text, tone),
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
    mean = " ± ".join(format_with_sigma(about.mean, about.mean_sigma))
    alt = (
        f"{len(one.x)} units; mean {mean}, spread {about.spread:.2g}"
        f" ({about.low:.2g} to {about.high:.2g}) {unit}"
    ).rstrip() + "."
    chart = Chart(
        f"values-{one.name}", one.name, alt, _units(found, one),
        Axis("value", unit), (seen,), tuple(levels),
    )  # fmt: skip
    numbers = one.unit_numbers.tolist()
    names = {o.folder for o in found.odd if o.parameter == one.name}
    odd = [unit_name(found.units[i]) for i in numbers if found.units[i].folder in names]
    what = f" Measure again: {', '.join(odd)}." if odd else ""
    return Figure(chart, f"{alt} Bars are each unit's own ± 1σ.{what}")


def _units(found: LotAnalysis, one: LotParameter, first: int = 0) -> Axis:
    """Serial numbers of the units that have a parameter, from the `first` one."""
    numbers = one.unit_numbers.tolist()[first:]
    serials = tuple(unit_name(found.units[i]) for i in numbers)
    return Axis("unit, in order of time", names=serials)


def _control(found: LotAnalysis) -> list[ReportBlock]:
    """Charts with an alarm, and the others folded."""
    out: list[ReportBlock] = [Paragraph(CHARTS)]
    if found.untimed:
        out.append(Paragraph(untimed_sentence(found)))
    calm: list[ReportBlock] = []
    for one in found.parameters.values():
        for chart in one.charts:
            shown = _chart(found, one, chart)
            (calm if chart.alarm is None else out).append(shown)
    if calm:
        several = "s" if len(calm) > 1 else ""
        out.append(Collapsible(f"{len(calm)} chart{several} in control", tuple(calm)))
    return out


def _chart(found: LotAnalysis, one: LotParameter, chart: ControlChart) -> Figure:
    at = np.arange(len(chart.values), dtype=float)
    limits = [
        Series(f"limit {sign:+d}", at, sign * chart.limit, 2, "line")
        for sign in (1, -1)
    ]
    seen = Series(chart.name, at, chart.values, 1, "both")
    units, name = _units(found, one, one.untimed), f"{chart.name}, {one.name}"
    said = "In control: nothing to do."
    if chart.alarm is not None and chart.onset is not None:
        said = (
            f"Beyond its limits at {units.names[chart.alarm]}. The mean changes at"
            f" about {units.names[chart.onset]}: ask what changed there (parts,"
            " fixture, station, software, temperature)."
        )
    drawn = Chart(
        f"{chart.name}-{one.name}", name, f"{name}: {said}", units,
        Axis(chart.name, "σ"), (seen, *limits),
    )  # fmt: skip
    return Figure(drawn, said)
