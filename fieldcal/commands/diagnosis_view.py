"""A diagnosis as a person at a terminal reads it."""

from __future__ import annotations

from typing import IO

from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.result import Found, Mismatch, Quantity
from fieldcal.diagnosis.words import said

STYLES = {
    "consistent": "bold green",
    "left_out": "bold yellow",
    "ambiguous": "bold yellow",
    "unexplained": "bold red",
}

WIDEST = 24
"""Cells of the bar that shows how significant a mismatch is."""


def show(diagnosis: Diagnosis, out: IO[str] | None = None) -> None:
    """Print verdict, mismatch, effects, improvement and calibration."""
    from rich.console import Console
    from rich.text import Text

    console = Console(file=out, highlight=False)
    verdict = diagnosis.verdict.replace("_", " ")
    console.print(Text(verdict.upper(), style=STYLES[diagnosis.verdict]))
    console.print(diagnosis.says, markup=False)
    if diagnosis.mismatch:
        console.print(_mismatch(diagnosis.mismatch))
    if diagnosis.effects:
        console.print(_effects(diagnosis.effects))
    console.print(_fit(diagnosis))
    console.print(_calibration(diagnosis))


def _mismatch(mismatch: tuple[Mismatch, ...]) -> object:
    from rich.table import Table

    table = Table(title="Where the two part", title_justify="left")
    for name in ("channel", "kind", "positions", "time s", "follows"):
        table.add_column(name)
    table.add_column("rms", justify="right")
    table.add_column("significance")
    most = max((m.sigma for m in mismatch if m.sigma < float("inf")), default=1.0)
    for m in mismatch:
        finite = m.sigma < float("inf")
        bar = "█" * max(1, round(WIDEST * (min(m.sigma, most) / most) ** 0.5))
        table.add_row(
            m.channel,
            m.kind,
            ranges(m.positions),
            f"{m.from_s:.1f} – {m.to_s:.1f}",
            m.covariate,
            f"{m.rms:.3g}",
            f"{bar} {m.sigma:.0f} σ" if finite else bar,
        )
    return table


def ranges(numbers: tuple[int, ...]) -> str:
    """Numbers with runs of them shortened.

    >>> ranges((0, 1, 2, 5, 7, 8))
    '0–2, 5, 7–8'
    """
    parts: list[list[int]] = []
    for n in sorted(numbers):
        if parts and n == parts[-1][1] + 1:
            parts[-1][1] = n
        else:
            parts.append([n, n])
    return ", ".join(f"{a}–{b}" if b > a else f"{a}" for a, b in parts)


def _effects(effects: tuple[Found, ...]) -> object:
    from rich.table import Table

    table = Table(title="What is left out", title_justify="left")
    for name in ("effect", "parameter", "value ± 1σ", "Δχ²", "unseen rms"):
        right = name in ("Δχ²", "unseen rms")
        table.add_column(name, justify="right" if right else "left")
    table.add_column("or else")
    for found in effects:
        gain = found.evidence.get("held_out_gain", float("nan"))
        squares = found.evidence.get("delta_chi2", float("nan"))
        first = [
            f"{squares:.0f}" if abs(squares) < float("inf") else "",
            f"{-100 * gain:+.0f} %" if gain == gain else "",
            ", ".join(found.aliases),
        ]
        rows: list[tuple[str, Quantity | None]] = [*found.parameters.items()]
        for i, (name, quantity) in enumerate(rows or [("", None)]):
            lead = found.id if not i else ""
            value = said(quantity) if quantity is not None else ""
            table.add_row(lead, name, value, *(first if not i else ["", "", ""]))
    return table


def _fit(diagnosis: Diagnosis) -> object:
    from rich.table import Table

    table = Table(title="Agreement", title_justify="left")
    for name in ("", f"rms {diagnosis.unit}", "χ²/dof", "rms predicted unseen"):
        table.add_column(name, justify="right" if name else "left")
    for label, q in (("before", diagnosis.before), ("after", diagnosis.after)):
        table.add_row(
            label, f"{q.rms:.3g}", f"{q.chi2_per_dof:.2f}", f"{q.held_out_rms:.3g}"
        )
    return table


def _calibration(diagnosis: Diagnosis) -> object:
    from rich.table import Table

    from fieldcal.calibration.wording import TITLES, number

    table = Table(title="Calibration with it", title_justify="left")
    for name in ("parameter", "value", "± 1σ", "unit", "change"):
        right = name in ("value", "± 1σ", "change")
        table.add_column(name, justify="right" if right else "left")
    for name, group in diagnosis.calibration.items():
        for axis, value, sigma, change in zip(
            "xyz", group.value, group.sigma, group.change, strict=True
        ):
            if value == value:
                shown = number(value, sigma)
                moved = f"{change / sigma:+.1f} σ" if sigma > 0 else ""
                table.add_row(f"{TITLES[name]} {axis}", *shown, group.unit, moved)
    return table
