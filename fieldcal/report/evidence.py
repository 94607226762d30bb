"""Evidence of a diagnosis: residuals over covariates, candidates, next steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration.wording import format_unit
from fieldcal.core.samples import Array
from fieldcal.report.blocks import Cell, Figure, ReportBlock, foldable_table, table
from fieldcal.report.charts import Axis, Chart, ChartMark, Series
from fieldcal.report.loose import (
    Json,
    format_number,
    list_at,
    number_or_nan,
    objects_at,
    table_at,
)

MOST_CURVES = 6
MOST_CANDIDATES = 12
"""Largest numbers that are shown; the other candidates can be opened."""


def residual_curves(found: Sequence[Json]) -> list[ReportBlock]:
    """Charts of the residual over its covariate, without and with the effects."""
    blocks: list[ReportBlock] = []
    for i, curve in enumerate(found[:MOST_CURVES]):
        channel, covariate = (str(curve.get(k, "")) for k in ("channel", "covariate"))
        x = np.array([number_or_nan(v) for v in list_at(curve, "x")])
        x += covariate == "position"  # which is counted from 0 in the file
        sigma = _column(curve, "sigma", len(x))
        series = tuple(
            Series(name, x, y, tone, low=y - sigma, high=y + sigma)
            for tone, name in ((2, "before"), (1, "after"))
            if np.isfinite(y := _column(curve, name, len(x))).any()
        )
        if not len(x) or not series:
            continue
        sizes = [f"{s.name} {_rms(s):.2g}" for s in series]
        chart = Chart(
            f"curve-{i}",
            f"Residual of {channel} over {covariate}",
            f"rms of the residual of {channel}: {', '.join(sizes)}.",
            Axis(covariate, format_unit(str(curve.get("unit", "")))),
            Axis("residual", "m/s²" if channel.startswith("a") else "rad/s"),
            series,
        )
        blocks.append(Figure(chart, "Before and after the effects are added."))
    return blocks


def _column(curve: Json, name: str, n: int) -> Array:
    """The numbers of a column, (n,); nan where they are missing."""
    values = np.array([number_or_nan(v) for v in list_at(curve, name)])
    return values if len(values) == n else np.full(n, np.nan)


def _rms(series: Series) -> float:
    known = series.y[np.isfinite(series.y)]
    return float(np.sqrt((known**2).mean())) if known.size else np.nan


def twin_replay(twin: Json) -> list[ReportBlock]:
    """Residuals of the session replayed by the virtual device, by position."""
    places = objects_at(twin, "positions")
    x = np.arange(len(places), dtype=float)
    series = tuple(
        Series(label, x, y, tone)
        for tone, name, label in ((2, "refitted", "before"), (1, "twin", "twin"))
        if np.isfinite(y := _agreement(places, name)).any()
    )
    if not series:
        return []
    names = tuple(_number(p.get("position")) for p in places)
    worst = [f"{s.name} {np.nanmax(s.y):.3g}" for s in series]
    chart = Chart(
        "replay",
        "Replayed by the virtual device",
        f"Largest χ² of a mean: {', '.join(worst)}.",
        Axis("position", names=names),
        Axis("χ² of a mean", log=True),
        series,
        (ChartMark(1.0, "noise"),),
    )
    return [Figure(chart, "How far a simulation with its own physics is off.")]


def _number(index: object) -> str:
    """Number of a position that the file counts from 0."""
    return str(index + 1) if isinstance(index, int) else ""


def _agreement(places: Sequence[Json], name: str) -> Array:
    chi2 = [number_or_nan(table_at(p, name).get("chi2_per_mean")) for p in places]
    return np.array([c if c > 0 else np.nan for c in chi2])


def candidate_table(found: Sequence[Json]) -> list[ReportBlock]:
    """Table of every effect that was tried, with the reason if it was rejected."""
    # of each as the only cause; those of an effect beside all others stand above
    columns = ("effect", ">Δχ² alone", ">ΔBIC alone", ">held-out rms", "why")
    rows: list[list[str | Cell]] = [
        [
            str(c.get("id", "")).replace("_", " "),
            format_number(c.get("delta_chi2"), "{:.0f}"),
            format_number(c.get("delta_bic"), "{:.0f}"),
            format_number(-100 * number_or_nan(c.get("held_out_gain")), "{:+.0f} %"),
            Cell("chosen", "good")
            if c.get("chosen") is True
            else str(c.get("why", "")),
        ]
        for c in found
    ]
    return (
        foldable_table("What was tried", columns, rows, MOST_CANDIDATES) if rows else []
    )


def next_steps_table(found: Json) -> list[ReportBlock]:
    """Table of the next steps in the field, one row each."""
    said = found.get("next")
    given = [said] if isinstance(said, str) else list_at(found, "next")
    rows: list[list[str | Cell]] = [[t] for t in dict.fromkeys(map(str, given)) if t]
    return [table("What to do next", ("do",), rows)] if rows else []
