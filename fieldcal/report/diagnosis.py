"""What the simulation leaves out, as diagnosis.json says.

Every key may be absent: an older file, or a diagnosis that had nothing to say of it.
Verdict, what to do, each effect in one line and the picture come first, in the words
of the terminal; what stands behind them follows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fieldcal.calibration.wording import (
    TITLES,
    format_unit,
    format_with_sigma,
    position_numbers,
)
from fieldcal.core.samples import CHANNELS, common_unit
from fieldcal.diagnosis.wording.lines import calibration_holds, verdict_probability
from fieldcal.report import evidence
from fieldcal.report.blocks import (
    Cell,
    Figure,
    NameValues,
    Paragraph,
    ReportBlock,
    Section,
    Tone,
    WarningBox,
    foldable_table,
    table,
)
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.loose import (
    Json,
    format_number,
    group_alike,
    list_at,
    number_or_nan,
    objects_at,
    table_at,
)

MAX_SHOWN_ROWS = 10
"""Rows of the mismatch that are shown; the rest can be opened."""

TONES: dict[str, Tone] = {
    "consistent": "good",
    "left_out": "warn",
    "ambiguous": "warn",
    "unexplained": "bad",
}


def verdict_box(
    found: Mapping[str, Any], called: Mapping[str, str] | None = None
) -> WarningBox:
    """The verdict of a diagnosis with its probability; `called` replaces its name."""
    verdict = str(found.get("verdict", "unknown"))
    named = len(objects_at(found, "lines"))
    sure = verdict_probability(verdict, number_or_nan(found.get("probability")), named)
    name = (called or {}).get(verdict, verdict).replace("_", " ")
    lead = f"{name.upper()}, {sure}"
    return WarningBox(lead, TONES.get(verdict, "warn"))


def diagnosis_section(material: ReportMaterial) -> Section | None:
    """Verdict, next steps, effects and reasons; None without a diagnosis."""
    found = material.diagnosis
    if found is None:
        return None
    blocks: list[ReportBlock] = [verdict_box(found)]
    blocks += evidence.next_steps_table(found)
    blocks += _lines(objects_at(found, "lines"))
    effects = objects_at(found, "effects")
    if effects:
        blocks += _fit(table_at(found, "fit"))
    if said := str(found.get("says", "")):
        blocks.append(Paragraph(format_unit(said)))
    blocks += [WarningBox(str(w)) for w in list_at(found, "warnings")]
    mismatch = objects_at(found, "mismatch")
    if mismatch:
        blocks += _mismatch(mismatch)
    blocks += evidence.residual_curves(objects_at(found, "curves"))
    if effects:
        blocks.append(_effects(effects))
        names = [str(e.get("id", "")) for e in effects]
        blocks += _calibration(table_at(found, "calibration"), names)
    blocks += evidence.twin_replay(table_at(found, "twin"))
    blocks += evidence.candidate_table(objects_at(found, "candidates"))
    return Section("diagnosis", "Diagnosis", tuple(blocks))


def _lines(found: Sequence[Json]) -> list[ReportBlock]:
    """Each effect in one line, as the terminal shows it."""
    keys = ("what", "size", "sure", "does")
    rows = [[str(line.get(key, "")) for key in keys] for line in found]
    columns = ("left out", "how big", "how sure", "does to calibration")
    return [table("What is left out", columns, rows)] if rows else []


def _mismatch(rows: Sequence[Json]) -> list[ReportBlock]:
    sigmas = [number_or_nan(m.get("sigma")) for m in rows]
    most = max((s for s in sigmas if math.isfinite(s)), default=1.0) or 1.0
    cells: list[list[str | Cell]] = []
    for names, m in group_alike(rows, "channel"):
        sigma = number_or_nan(m.get("sigma"))
        finite = math.isfinite(sigma)
        size = Cell(
            f"{sigma:.0f} σ" if finite else "beyond doubt",
            bar=math.sqrt(np.clip(sigma / most, 0.0, 1.0)) if finite else 1.0,
        )
        span = dict.fromkeys(
            f"{number_or_nan(m.get(k)):.1f}" for k in ("from_s", "to_s")
        )
        cells.append(
            [
                " ".join(names),
                str(m.get("kind", "")),
                position_numbers(
                    p for p in list_at(m, "positions") if isinstance(p, int)
                ),
                " – ".join(span),
                str(m.get("covariate", "")),
                _rms(names, number_or_nan(m.get("rms"))),
                size,
            ]
        )
    columns = (
        "channel",
        "kind",
        "positions",
        "time, s",
        "follows",
        ">rms",
        ">significance",
    )
    return foldable_table(
        "Where recording and simulation part", columns, cells, MAX_SHOWN_ROWS
    )


def _rms(names: Sequence[str], rms: float) -> str:
    """Size of a residual with its unit; empty if the sensors have different units."""
    unit = common_unit(names)
    return "–" if unit is None else f"{rms:.3g} {format_unit(unit)}".strip()


def _effects(effects: Sequence[Json]) -> ReportBlock:
    rows = []
    for effect in effects:
        proof = table_at(effect, "evidence")
        weight = [
            format_number(proof.get("delta_chi2"), "{:.0f}"),
            format_number(
                -100 * number_or_nan(proof.get("held_out_gain")), "{:+.0f} %"
            ),
            ", ".join(str(a) for a in list_at(effect, "aliases")),
        ]
        values: list[tuple[str, Any]] = list(table_at(effect, "parameters").items())
        for i, (name, quantity) in enumerate(values or [("", {})]):
            lead = str(effect.get("id", "")).replace("_", " ") if i == 0 else ""
            rest = weight if i == 0 else ["", "", ""]
            rows.append([lead, str(name), *_quantity(quantity), *rest])
    columns = ("effect", "parameter", ">value", ">± 1σ", "unit")
    return table(
        "The effects' parameters", (*columns, ">Δχ²", ">held-out rms", "or else"), rows
    )


def _quantity(quantity: object) -> tuple[str, str, str]:
    if not isinstance(quantity, Mapping):
        return "", "", ""
    value, sigma = quantity.get("value"), number_or_nan(quantity.get("sigma"))
    unit = format_unit(str(quantity.get("unit", "")))
    if not isinstance(value, int | float):
        return str(value if value is not None else ""), "", unit
    return (*format_with_sigma(float(value), sigma), unit)


def _fit(fit: Json) -> list[ReportBlock]:
    before, after = table_at(fit, "before"), table_at(fit, "after")
    if not before or not after:
        return []
    unit = format_unit(str(fit.get("unit", "m/s^2")))
    facts = [
        (f"rms, {unit}", "rms", "{:.3g}"),
        ("χ² per degree of freedom", "chi2_per_dof", "{:.2f}"),
        (f"held-out rms, {unit}", "held_out_rms", "{:.3g}"),
    ]
    blocks: list[ReportBlock] = [
        Paragraph(
            "How well the simulation does before and after the effects are added:"
        ),
        NameValues(
            tuple(
                (
                    name,
                    " → ".join(format_number(fit.get(k), f) for fit in (before, after)),
                )
                for name, k, f in facts
            )
        ),
    ]
    chart = _by_channel(before, after)
    if chart is not None:
        caption = "rms of what was predicted without having been fitted to."
        blocks.append(Figure(chart, caption))
    return blocks


def _by_channel(before: Json, after: Json) -> Chart | None:
    first, then = (table_at(q, "held_out_by_channel") for q in (before, after))
    names = [c for c in CHANNELS if c in first and c in then]
    if not names:
        return None
    x = np.arange(len(names), dtype=float)
    series = []
    for tone, (label, values) in ((2, ("before", first)), (1, ("after", then))):
        y = np.array([number_or_nan(values[c]) for c in names])
        series.append(Series(label, x, y, tone))
    pairs = [
        f"{c} {number_or_nan(first[c]):.2g} to {number_or_nan(then[c]):.2g}"
        for c in names
    ]
    return Chart(
        "diagnosis-channels",
        "Held out, before and after",
        f"From before to after: {', '.join(pairs)} (m/s² and rad/s).",
        Axis("channel", names=tuple(names)),
        Axis("rms, m/s² or rad/s", log=True),
        tuple(series),
    )


def _calibration(groups: Json, effects: Sequence[str]) -> list[ReportBlock]:
    """Biases and scale factors beside effects, given by id, and when they hold."""
    rows: list[list[str]] = []
    for name, group in groups.items():
        if not isinstance(group, Mapping):
            continue
        unit = format_unit(str(group.get("unit", "")))
        triads = (list_at(group, k) for k in ("value", "sigma"))
        for axis, value, sigma in zip("xyz", *triads, strict=False):
            if isinstance(value, int | float):
                format_number = format_with_sigma(float(value), number_or_nan(sigma))
                rows.append([f"{TITLES.get(name, name)} {axis}", *format_number, unit])
    if not rows:
        return []
    columns = ("parameter", ">value", ">± 1σ", "unit")
    holds = calibration_holds(effects)
    return [
        table("Calibration with the effects", columns, rows),
        *([Paragraph(holds)] if holds else []),
    ]
