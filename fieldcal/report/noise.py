"""Effect of averaging: the Allan deviation of the longest stretch at rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fieldcal.calibration import over_time
from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS
from fieldcal.report.blocks import Figure, Paragraph, Section, Table, table
from fieldcal.report.blocks import ReportBlock as Part
from fieldcal.report.charts import SENSORS, Axis, Chart, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.session.noise_file import read_noise
from fieldcal.windows.allan import MIN_RECORDING_S, AllanDeviation, allan_deviation
from fieldcal.windows.stretches import still_stretches

MAX_SAMPLES = 1_000_000
"""Largest number of samples that is evaluated; more take seconds and add little."""


def noise_section(material: ReportMaterial) -> Section:
    """Allan deviation of both triads, and the contents of noise.json."""
    section = _of_recording(material)
    more: list[Part] = []
    found = read_noise(material.session.folder)
    if found is not None:
        more.append(averaging_advice(found))
    if material.calibration is not None and "over_time" in material.calibration.info:
        more += allan_blocks_by_parameter(material.calibration.info["over_time"])
    return replace(section, blocks=(*section.blocks, *more))


def allan_blocks_by_parameter(told: Mapping[str, Any]) -> list[Part]:
    """Charts of each parameter's ± over the averaging time, from result.json."""
    first, *times, unit = over_time.heading(told)
    columns = (first, *(f">{time}" for time in times), unit)
    caption = "± of each parameter by averaging time, of the first part of each window"
    texts = [Paragraph(f"{s[0].upper()}{s[1:]}.") for s in over_time.sentences(told)]
    return [table(caption, columns, over_time.rows(told)), *texts]


def averaging_advice(found: Mapping[str, Any]) -> Table:
    """Recommended averaging time, from noise.json."""
    every = [(name, c, c["averaging"]) for name, c in found["channels"].items()]
    windows = sorted({s for _, _, told in every for s in told["seconds"]})
    rows = []
    for name, channel, told in every:
        errors = zip(told["sigma"], told["spread"], strict=True)
        cells = [f"{value:.2g} ± {spread:.1g}" for value, spread in errors]
        best, unit = told["best_s"], format_unit(channel["unit"])
        rows.append(
            [
                name,
                *cells + [""] * (len(windows) - len(cells)),
                f"{told['best_sigma']:.2g}",
                "longer than is known" if best is None else f"{best:.0f} s",
                unit,
            ]
        )
    columns = ("channel", *(f">{w:.0f} s" for w in windows), ">least", ">averaged")
    caption = "Error of a mean; the papers average for 30 to 60 s"
    return table(caption, (*columns, "unit"), rows)


def _of_recording(material: ReportMaterial) -> Section:
    """Allan deviation of the session's longest stretch, or the reason for none."""
    span = _longest(material)
    parts: tuple[Part, ...]
    if span[1] - span[0] < MIN_RECORDING_S:
        parts = (
            Paragraph(
                f"The longest stretch at rest lasts {span[1] - span[0]:.0f} s. Record"
                f" {MIN_RECORDING_S:.0f} s or more at rest to see how far averaging"
                " helps."
            ),
        )
        return Section("noise", "Noise", parts)
    block = material.block.between(*span)[:MAX_SAMPLES]
    try:
        found = allan_deviation(block)
        levels = _table(found)
    except InputError as error:
        parts = (Paragraph(f"No Allan deviation: {error}."),)
    else:
        where = f"From {block.t[0]:.0f} to {block.t[-1]:.0f} s of device time."
        parts = (*_figures(found, where), levels)
    return Section("noise", "Noise", parts)


def _longest(material: ReportMaterial) -> tuple[float, float]:
    """The longest stretch at rest: a window, or else a stretch found by search."""
    still = material.windows
    spans = [(a.start, a.end) for a in still.averages] if still is not None else []
    best = max(spans, key=_length, default=(0.0, 0.0))
    whole = float(material.block.t[-1] - material.block.t[0])
    if _length(best) < MIN_RECORDING_S <= whole:
        return max([best, *still_stretches(material.block)], key=_length)
    return best


def _length(span: tuple[float, float]) -> float:
    return span[1] - span[0]


def _figures(found: AllanDeviation, where: str) -> list[Part]:
    out: list[Part] = []
    for first, what, unit in SENSORS:
        series = tuple(
            Series(
                CHANNELS[i],
                found.tau,
                found.deviation[:, i],
                i % 3 + 1,
                "both",
                found.low[:, i],
                found.high[:, i],
            )
            for i in range(first, first + 3)
            if np.isfinite(found.deviation[:, i]).any()
        )
        if series:
            least = [f"{s.name} {np.nanmin(s.y):.2g} {unit}" for s in series]
            over = f"Over {found.tau[0]:.2g} to {found.tau[-1]:.3g} s"
            alt = f"{over}; least: {', '.join(least)}."
            out.append(Figure(allan_chart(what, unit, alt, series), where))
    return out


def allan_chart(what: str, unit: str, alt: str, series: tuple[Series, ...]) -> Chart:
    """Allan deviations of a triad over the averaging time."""
    return Chart(
        f"allan-{what}",
        f"Allan deviation, {what}",
        alt,
        Axis("averaging time τ", "s", log=True),
        Axis("Allan deviation", unit, log=True),
        series,
    )


def _table(found: AllanDeviation) -> Table:
    rows = []
    one, second = found.sigma_of_mean(1.0), int(np.argmin(np.abs(found.tau - 1.0)))
    half = (found.high - found.low) / 2
    for i, name in enumerate(CHANNELS):
        if not np.isfinite(found.deviation[:, i]).any():
            continue
        unit = "m/s²" if i < 3 else "rad/s"
        k = int(np.nanargmin(found.deviation[:, i]))
        rows.append(
            [
                name,
                f"{' ± '.join(format_with_sigma(one[i], half[second, i]))} {unit}",
                f"{' ± '.join(format_with_sigma(found.deviation[k, i], half[k, i]))}"
                f" {unit}",
                f"{found.tau[k]:.0f} s",
            ]
        )
    columns = ("channel", ">error of a mean over 1 s", ">least error", ">averaged over")
    return table("How far averaging helps", columns, rows)
