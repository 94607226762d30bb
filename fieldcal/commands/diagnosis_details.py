"""All numbers of a diagnosis: mismatches, parameters, agreement, calibration, twin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldcal.calibration.wording import position_numbers
from fieldcal.core.samples import common_unit
from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.result import FoundEffect, Mismatch
from fieldcal.diagnosis.wording.lines import calibration_holds, format_probability
from fieldcal.diagnosis.wording.paragraph import with_uncertainty

if TYPE_CHECKING:
    from rich.console import Console

    from fieldcal.twin import ReplayResult

FOLLOWS_WIDTH = 22
"""Least width of the column "follows", characters, for some words on each line."""

SIGMA_BAR_WIDTH = 4
"""Longest bar of the significance of a mismatch, characters."""

BRIEF_S = 5.0
"""Limits of stretches shorter than this are shown to 0.1 s, s."""


def print_details(console: Console, diagnosis: Diagnosis) -> None:
    """Print all numbers of the diagnosis."""
    console.print(f"\n{diagnosis.says}", markup=False)
    if diagnosis.mismatch:
        console.print(_mismatch_table(diagnosis.mismatch))
    for found in diagnosis.effects:
        console.print(_effect_heading(found), markup=False)
        if found.parameters:
            console.print(_parameter_table(found))
    console.print(_agreement_table(diagnosis))
    console.print(_calibration_table(diagnosis))
    if holds := calibration_holds(found.id for found in diagnosis.effects):
        console.print(holds, markup=False)


def _mismatch_table(mismatch: tuple[Mismatch, ...]) -> object:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title="Where the two part",
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    table.add_column("channel")
    table.add_column("follows", min_width=FOLLOWS_WIDTH)
    for name in ("positions", "time, s"):
        table.add_column(name, no_wrap=name == "time, s")
    table.add_column("rms", justify="right", no_wrap=True)
    table.add_column("σ", no_wrap=True)
    most = max((m.sigma for m in mismatch if m.sigma < float("inf")), default=1.0)
    for names, m in _group_by_channel(mismatch):
        finite = m.sigma < float("inf")
        bar = "█" * max(1, round(SIGMA_BAR_WIDTH * (min(m.sigma, most) / most) ** 0.5))
        digits = 0 if m.to_s - m.from_s >= BRIEF_S else 1
        span = dict.fromkeys(f"{t:.{digits}f}" for t in (m.from_s, m.to_s))
        table.add_row(
            " ".join(names),
            m.kind if m.covariate in (m.kind, "") else f"{m.kind}: {m.covariate}",
            position_numbers(m.positions),
            "–".join(span),
            _format_rms(names, m.rms),
            f"{bar} {m.sigma:.0f}" if finite else bar,
        )
    return table


def _group_by_channel(
    mismatch: tuple[Mismatch, ...],
) -> list[tuple[list[str], Mismatch]]:
    """Mismatches that are equal but for the channel, each with its channels."""
    found: dict[object, tuple[list[str], Mismatch]] = {}
    for m in mismatch:
        place = (m.kind, m.positions, m.from_s, m.to_s, m.covariate)
        names, _ = found.setdefault((*place, m.rms, m.sigma), ([], m))
        names.append(m.channel)
    return list(found.values())


def _format_rms(names: list[str], rms: float) -> str:
    """Size of a residual with its unit; a dash if the channels have different units."""
    unit = common_unit(names)
    return "–" if unit is None else f"{rms:.3g} {unit}".strip()


def _effect_heading(found: FoundEffect) -> str:
    """Line with an effect and its evidence."""
    gain = found.evidence.get("held_out_gain", float("nan"))
    squares = found.evidence.get("delta_chi2", float("nan"))
    about = [
        f"Left out: {found.id}, probability {format_probability(found.probability)}"
    ]
    if abs(squares) < float("inf"):
        about.append(f"Δχ² {squares:.0f}")
    if gain == gain:
        about.append(f"held-out rms {-100 * gain:+.0f} %")
    if found.aliases:
        about.append(f"or else {', '.join(found.aliases)}")
    return "; ".join(about)


def _parameter_table(found: FoundEffect) -> object:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD)
    table.add_column("parameter")
    table.add_column("value ± 1σ")
    for name, quantity in found.parameters.items():
        table.add_row(name, with_uncertainty(quantity))
    return table


def _agreement_table(diagnosis: Diagnosis) -> object:
    from rich.table import Table

    table = Table(title="Agreement", title_justify="left")
    for name in ("", f"rms {diagnosis.unit}", "χ²/dof", "held-out rms"):
        table.add_column(name, justify="right" if name else "left")
    for label, q in (("before", diagnosis.before), ("after", diagnosis.after)):
        table.add_row(
            label, f"{q.rms:.3g}", f"{q.chi2_per_dof:.2f}", f"{q.held_out_rms:.3g}"
        )
    return table


def _calibration_table(diagnosis: Diagnosis) -> object:
    from rich.table import Table

    from fieldcal.calibration.wording import TITLES, format_with_sigma

    table = Table(title="Calibration with it", title_justify="left")
    for name in ("parameter", "value", "± 1σ", "unit", "change"):
        right = name in ("value", "± 1σ", "change")
        table.add_column(name, justify="right" if right else "left")
    for name, group in diagnosis.calibration.items():
        for axis, value, sigma, change in zip(
            "xyz", group.value, group.sigma, group.change, strict=True
        ):
            if value == value:
                shown = format_with_sigma(value, sigma)
                moved = f"{change / sigma:+.1f} σ" if sigma > 0 else ""
                table.add_row(f"{TITLES[name]} {axis}", *shown, group.unit, moved)
    return table


def replay_table(again: ReplayResult) -> object:
    """Table of how a virtual twin repeats the recording."""
    from rich.table import Table

    unit = UNITS[again.triad]
    table = Table(
        title=f"Replayed by the virtual device: rms {unit} (χ² a mean)",
        title_justify="left",
    )
    table.add_column("position", justify="right")
    for name in ("as session.toml has it", "refitted", "twin"):
        table.add_column(name, justify="right")
    runs = list(again.runs.values())
    for i, position in enumerate(again.positions):
        cells = [
            f"{run.by_position[i, again.triad]:.2g} ({run.chi2_by_position[i]:.3g})"
            for run in runs
        ]
        table.add_row(str(position + 1), *cells)
    table.add_section()
    whole = [f"{r.rms[again.triad]:.2g} ({r.chi2_per_dof:.3g})" for r in runs]
    table.add_row("all", *whole)
    return table
