"""Terminal view of a diagnosis.

First come the verdict and what to do, then one line for each effect and a bar chart of
the residuals. With `details`, all numbers follow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import IO, TYPE_CHECKING

from fieldcal.calibration.wording import format_unit
from fieldcal.diagnosis import Diagnosis
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.wording.lines import verdict_probability

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from fieldcal.twin import ReplayResult
from fieldcal.commands.diagnosis_details import print_details, replay_table

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


LINES_BELOW = 3
"""Lines of a screen below a diagnosis: the file it is written to, and the prompt."""


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
        print_details(console, diagnosis)
    if again is not None:
        console.print(replay_table(again))


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

    before, after = (q.held_out_by_channel for q in (diagnosis.before, diagnosis.after))
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
