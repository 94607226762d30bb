"""Terminal view of a diagnosis.

First come the verdict and what to do, then one line for each effect and a bar chart of
the residuals. With `details`, all numbers follow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import IO, TYPE_CHECKING

from fieldcal.calibration.wording import format_unit, position_numbers
from fieldcal.core.samples import common_unit
from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.result import FoundEffect, Mismatch
from fieldcal.diagnosis.wording.lines import (
    calibration_holds,
    format_probability,
    verdict_probability,
)
from fieldcal.diagnosis.wording.paragraph import with_uncertainty

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from fieldcal.twin import ReplayResult

STYLES = {
    "consistent": "bold green",
    "left_out": "bold yellow",
    "ambiguous": "bold yellow",
    "unexplained": "bold red",
}

STEPS_SHOWN = 3
"""Number of recommended steps that are shown without `details`."""

BAR_WIDTH = 14
"""Width of a bar, characters: two fit side by side in 80 columns."""

FOLLOWS_WIDTH = 22
"""Least width of the column "follows", characters, for some words on each line."""

SIGMA_BAR_WIDTH = 4
"""Longest bar of the significance of a mismatch, characters."""

LINES_BELOW = 3
"""Lines of a screen below a diagnosis: the file it is written to, and the prompt."""

BRIEF_S = 5.0
"""Limits of stretches shorter than this are shown to 0.1 s, s."""


def show_diagnosis(
    diagnosis: Diagnosis,
    again: ReplayResult | None = None,
    out: IO[str] | None = None,
    details: bool = False,
    width: int | None = None,
    height: int | None = None,
) -> None:
    """Print verdict, what to do, effects and residuals; with `details` all the rest.

    `width` and `height` are those of the terminal unless given. Without `details`, as
    many effects are shown as fit on one screen together with the verdict. Output that
    is no terminal gets all of them.
    """
    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole(file=out, width=width)
    if height is None and console.is_terminal:
        height = console.height
    head = [_verdict_line(diagnosis), *_next_steps(diagnosis, details)]
    picture = _residual_bars(diagnosis)
    rest = sum(_line_count(console, part) for part in (*head, *picture))
    room = None if details or height is None else height - LINES_BELOW - rest
    for part in (*head, *_fitting_effect_table(console, diagnosis, room), *picture):
        console.print(part)
    if details:
        _print_details(console, diagnosis)
    if again is not None:
        console.print(_replay_table(again))


def _line_count(console: Console, part: RenderableType) -> int:
    return len(console.render_lines(part, pad=False))


def _verdict_line(diagnosis: Diagnosis) -> RenderableType:
    from rich.text import Text

    verdict = diagnosis.verdict.replace("_", " ")
    head = Text(verdict.upper(), style=STYLES[diagnosis.verdict])
    sure = verdict_probability(
        diagnosis.verdict, diagnosis.probability, len(diagnosis.lines)
    )
    return head + Text(f"  {sure}")


def _next_steps(diagnosis: Diagnosis, details: bool) -> list[RenderableType]:
    """Recommended steps, only the first ones without `details`."""
    steps = diagnosis.next if details else diagnosis.next[:STEPS_SHOWN]
    out = [_step_row(s) for s in steps]
    if not steps:
        out = [_step_row("Nothing: the simulation has all that this can show.")]
    if more := len(diagnosis.next) - len(steps):
        out.append(_step_row(f"{more} more: --details"))
    return out


def _step_row(text: str) -> RenderableType:
    """A recommended step; its further lines are indented to the first."""
    from rich.table import Table
    from rich.text import Text

    grid = Table.grid(padding=(0, 1))
    grid.add_row("→", Text(text))
    return grid


def _fitting_effect_table(
    console: Console, diagnosis: Diagnosis, room: int | None
) -> list[RenderableType]:
    """Table of the effects that fit into `room` lines, at least one; empty if none."""
    many = len(diagnosis.lines)
    while many > 1 and room is not None:
        if _line_count(console, _effect_table(diagnosis, many)) <= room:
            break
        many -= 1
    return [_effect_table(diagnosis, many)] if many else []


def _effect_table(diagnosis: Diagnosis, many: int) -> RenderableType:
    """Table of the first `many` effects, and the number of the others."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, expand=True)
    for name, ratio in (("left out", 5), ("how big", 7)):
        table.add_column(name, ratio=ratio)
    table.add_column("how sure", no_wrap=True)
    table.add_column("does to calibration", ratio=7)
    for line in diagnosis.lines[:many]:
        cells = (line.what, line.size, line.sure, line.does)
        table.add_row(*map(Text, cells))
    if more := len(diagnosis.lines) - many:
        table.add_row(f"{more} more", "--details")
    return table


def _residual_bars(diagnosis: Diagnosis) -> list[RenderableType]:
    """Held-out residuals before and after the diagnosis, as a bar for each channel."""
    from rich.table import Table
    from rich.text import Text

    before, after = diagnosis.before.by_channel, diagnosis.after.by_channel
    names = [n for n in before if before[n] > 0 and after.get(n, 0.0) > 0]
    if not names:
        return []
    legend = f"held-out rms, {format_unit(UNITS[0])} and {format_unit(UNITS[1])}"
    grid = Table.grid(padding=(0, 2))
    triads = [[n for n in names if n[0] == triad] for triad in "ag"]
    for pair in zip_longest(*(t for t in triads if t)):
        grid.add_row(*(_residual_bar(name, names, before, after) for name in pair))
    return [Text(f"{legend}   ░ before  █ after", style="bold"), grid]


def _residual_bar(
    name: str | None,
    names: Sequence[str],
    before: Mapping[str, float],
    after: Mapping[str, float],
) -> str:
    """Bar of a channel's residual before and after, scaled to the sensor's largest."""
    if name is None:
        return ""
    most = max(max(before[n], after[n]) for n in names if n[0] == name[0])
    first, then = (round(BAR_WIDTH * q[name] / most) for q in (before, after))
    bar = "█" * max(1, then) + "░" * (first - max(1, then))
    return f"{name} {bar:<{BAR_WIDTH}} {before[name]:.3g} → {after[name]:.3g}"


def _print_details(console: Console, diagnosis: Diagnosis) -> None:
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


def _replay_table(again: ReplayResult) -> object:
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
