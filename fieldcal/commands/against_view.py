"""Terminal view of a comparison with a simulator."""

from __future__ import annotations

from math import isfinite
from typing import IO

from fieldcal.against.motion.wording import alignment_sentence
from fieldcal.against.result import Match
from fieldcal.against.wording import difference_rows
from fieldcal.calibration.wording import format_unit, position_numbers
from fieldcal.commands.diagnosis_view import STYLES
from fieldcal.diagnosis.findings.agreement import UNITS
from fieldcal.diagnosis.wording.lines import format_probability, pretty_quantity
from fieldcal.report.against import VERDICTS


def show_match(
    found: Match,
    out: IO[str] | None = None,
    details: bool = False,
    width: int | None = None,
) -> None:
    """Print verdict, differences and prediction; with `details` also their places.

    `width` is in characters, by default that of the terminal.
    """
    from rich.text import Text

    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole(file=out, width=width)
    verdict = VERDICTS.get(found.verdict, found.verdict)
    head = Text(verdict.upper(), style=STYLES[found.verdict])
    sure = format_probability(found.probability)
    console.print(head + Text(f"  probability {sure}"))
    if found.differences:
        console.print(_difference_table(found))
    else:
        console.print(found.says, markup=False)
    console.print(_prediction_table(found))
    if found.aligned is not None and found.differences:
        console.print(alignment_sentence(found.aligned), markup=False)
    if details:
        if found.differences:
            console.print(f"\n{found.says}", markup=False)
            console.print(_location_table(found))
        console.print(_recording_table(found))


def _difference_table(found: Match) -> object:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, expand=True)
    for name, ratio in (("what", 4), ("simulator has it", 3), ("how big", 7)):
        table.add_column(name, ratio=ratio)
    table.add_column("real − simulator", ratio=4)
    table.add_column("how sure", no_wrap=True)
    for cells in difference_rows(found.differences):
        table.add_row(*map(Text, cells))
    return table


def _prediction_table(found: Match) -> object:
    from rich.table import Table

    table = Table(title="What was not fitted, predicted", title_justify="left")
    names = ("", *(f"rms {format_unit(unit)}" for unit in UNITS), "χ²/dof")
    for name in names:
        table.add_column(name, justify="right" if name else "left")
    for label, one in (("simulator", found.before), ("patched", found.after)):
        sizes = [f"{v:.2g}" if v == v else "–" for v in (one.rms_acc, one.rms_gyr)]
        table.add_row(label, *sizes, f"{one.chi2_per_dof:.3g}")
    return table


def _location_table(found: Match) -> object:
    from rich.table import Table

    table = Table(title="Where it shows", title_justify="left")
    for name in ("what", "channel", "follows", "positions", "time, s", "σ"):
        table.add_column(name)
    for one in found.differences:
        for m in one.where:
            follows = (
                m.kind if m.covariate in (m.kind, "") else f"{m.kind}: {m.covariate}"
            )
            span = f"{m.from_s:.0f}–{m.to_s:.0f}"
            places = position_numbers(m.positions)
            size = f"{m.sigma:.0f}" if isfinite(m.sigma) else "–"
            table.add_row(one.id, m.channel, follows, places, span, size)
    return table


def _recording_table(found: Match) -> object:
    from rich.table import Table

    table = Table(title="Recordings", title_justify="left")
    for name in ("", "real", "simulator"):
        table.add_column(name, justify="right" if name else "left")
    both = (found.real, found.simulator)
    table.add_row("rate, Hz", *(f"{one.rate_hz:.4g}" for one in both))
    for name, unit in zip(("step_acc", "step_gyr"), UNITS, strict=True):
        steps = [getattr(one, name) for one in both]
        shown = [f"{s:.3g}" if s == s else "none" for s in steps]
        table.add_row(f"step, {format_unit(unit)}", *shown)
    for name, axes in found.real.calibration.items() if found.aligned else ():
        for axis, told in axes.items():
            table.add_row(f"{name} {axis}", pretty_quantity(told), "reference")
    for channel in found.real.noise:
        cells = []
        for one in both:
            q = one.noise.get(channel)
            cells.append("–" if q is None else f"{q.value:.3g} ± {q.sigma:.1g}")
        table.add_row(f"noise {channel}", *cells)
    return table
