"""How a diagnosis came about: residuals over covariates, what was tried, what next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.calibration.wording import pretty
from fieldcal.effects import catalogue
from fieldcal.report.blocks import Block, Cell, Figure, Text, folded
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.loose import Json, list_at, objects_at, real, shown

MOST_CURVES = 6
MOST_CANDIDATES = 12
"""How many are shown; the rest of the candidates can be opened."""


def curves(found: Sequence[Json]) -> list[Block]:
    """Residual against what it follows, before and after."""
    blocks: list[Block] = []
    for i, curve in enumerate(found[:MOST_CURVES]):
        x = np.array([real(v) for v in list_at(curve, "x")])
        series = tuple(
            Series(name, x, y, tone)
            for tone, name in ((2, "before"), (1, "after"))
            if len(y := np.array([real(v) for v in list_at(curve, name)])) == len(x)
        )
        if not len(x) or not series:
            continue
        channel, covariate = (str(curve.get(k, "")) for k in ("channel", "covariate"))
        sizes = [f"{s.name} {_rms(s):.2g}" for s in series]
        chart = Chart(
            f"curve-{i}",
            f"Residual of {channel} over {covariate}",
            f"rms of the residual of {channel}: {', '.join(sizes)}.",
            Axis(covariate, pretty(str(curve.get("unit", "")))),
            Axis("residual", "m/s²" if channel.startswith("a") else "rad/s"),
            series,
        )
        blocks.append(Figure(chart, "Before and after the effects are added."))
    return blocks


def _rms(series: Series) -> float:
    known = series.y[np.isfinite(series.y)]
    return float(np.sqrt((known**2).mean())) if known.size else np.nan


def candidates(found: Sequence[Json]) -> list[Block]:
    """The league table: every effect that was tried, and why it lost."""
    columns = ("effect", ">Δχ²", ">ΔBIC", ">rms unseen", "what speaks against it")
    rows: list[list[str | Cell]] = [
        [
            str(c.get("id", "")).replace("_", " "),
            shown(c.get("delta_chi2"), "{:.0f}"),
            shown(c.get("delta_bic"), "{:.0f}"),
            shown(-100 * real(c.get("held_out_gain")), "{:+.0f} %"),
            str(c.get("why", "")),
        ]
        for c in found
    ]
    return folded("What was tried", columns, rows, MOST_CANDIDATES) if rows else []


def next_steps(found: Json) -> list[Block]:
    """What to do in the field now."""
    said = found.get("next")
    given = [said] if isinstance(said, str) else list_at(found, "next")
    texts = [str(text) for text in given] or _decisions(found)
    return [Text(f"Next: {text}") for text in texts if text]


def _decisions(found: Json) -> list[str]:
    """What would tell the effects apart that this recording cannot."""
    known = catalogue()
    texts = []
    for effect in objects_at(found, "effects"):
        name = str(effect.get("id", ""))
        others = [str(a) for a in list_at(effect, "aliases")]
        if name in known and others:
            listed = " or ".join(o.replace("_", " ") for o in others)
            texts.append(
                f"to tell {name.replace('_', ' ')} from {listed}, record"
                f" {known[name].decided_by}."
            )
    return texts
