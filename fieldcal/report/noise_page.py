"""Page of the noise of a device: curves with bands, sizes and consequences."""

from __future__ import annotations

import math

import numpy as np

from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.noise.document import NoiseResult
from fieldcal.noise.estimate import ChannelEstimate
from fieldcal.noise.wording import PROCESSES, TRIADS, consequences, value_or_bound
from fieldcal.report.blocks import Figure, NameValues, Paragraph, Section, Table, table
from fieldcal.report.blocks import ReportBlock as Part
from fieldcal.report.charts import Chart, Series
from fieldcal.report.noise import allan_chart, averaging_advice
from fieldcal.report.overview import PageHeader
from fieldcal.report.page import render_page


def render_noise_page(found: NoiseResult) -> str:
    """Render the noise of a device as HTML."""
    model = found.model
    name = str(found.device.get("name", "noise at rest"))
    facts = NameValues(
        (
            ("at rest", f"{model.seconds:.0f} s"),
            ("stretches", f"{model.stretches}"),
            ("rate", f"{model.rate_hz:.4g} Hz"),
            ("disturbed", f"{100 * model.bridged:.2g} %"),
        )
    )
    says = (
        "Points are what was measured, lines what the processes say, with the band"
        " that holds 68 of 100 recordings of this length."
    )
    top = PageHeader(
        name, " · ".join(found.sessions), "noise", "", says, facts, "IMU noise"
    )
    return render_page(
        top,
        [
            Section("allan", "Allan deviation", tuple(_figures(found))),
            Section("processes", "Processes", (_processes(found),)),
            Section(
                "averaging", "How long to average", (averaging_advice(found.to_json()),)
            ),
            Section("filters", "What follows", (*_follows(found), _programs(found))),
        ],
    )


def _figures(found: NoiseResult) -> list[Part]:
    out: list[Part] = []
    for triad, what in TRIADS:
        some = [c for n, c in found.model.channels.items() if n[0] == triad]
        if some:
            out.append(Figure(_chart(what, some, found.model.longest), ""))
    return out


def _chart(what: str, some: list[ChannelEstimate], length: float) -> Chart:
    series = []
    for i, channel in enumerate(some):
        seen = channel.measured
        said = channel.predict_allan(seen.tau, length)
        series += [
            Series(channel.name, seen.tau, seen.deviation, i + 1),
            Series(f"{channel.name} model", said.tau, said.median, i + 1, "line",
                   said.low, said.high),
        ]  # fmt: skip
    unit = format_unit(some[0].unit)
    least = [f"{c.name} {np.min(c.averaging.sigma):.2g} {unit}" for c in some]
    return allan_chart(what, unit, f"Least: {', '.join(least)}.", tuple(series))


def _processes(found: NoiseResult) -> Table:
    rows = []
    for channel in found.model.channels.values():
        for name, size in channel.processes.items():
            value = f"{size.value:.4g} ± {size.sigma:.2g} {format_unit(size.unit)}"
            known = size.time_sigma < size.time < math.inf
            time = f"{' ± '.join(format_with_sigma(size.time, size.time_sigma))} s"
            rows.append([channel.name, _named(name), value, time if known else ""])
        for name, size in channel.limits.items():
            bound = f"< {size.value:.2g} {format_unit(size.unit)}"
            rows.append([channel.name, _named(name), bound, ""])
    columns = ("channel", "process", ">size ± 1σ (< 95 %)", ">correlation time")
    return table("Sizes", columns, rows)


def _named(process: str) -> str:
    return f"{PROCESSES[process[0]]} {process}"


def _follows(found: NoiseResult) -> list[Part]:
    return [Paragraph(f"{text[0].upper()}{text[1:]}.") for text in consequences(found)]


def _programs(found: NoiseResult) -> Table:
    rows = []
    for program, values in found.programs.items():
        for name, (value, sigma, unit) in values.items():
            rows.append(
                [program, name, value_or_bound(value, sigma), format_unit(unit)]
            )
    columns = ("program", "name", ">value ± 1σ", "unit")
    return table("Parameters of other programs", columns, rows)
