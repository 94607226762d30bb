"""Terminal view of each parameter's uncertainty against the averaging time."""

from __future__ import annotations

from typing import IO

from fieldcal.calibration import Calibration
from fieldcal.calibration.over_time import heading, rows, sentences


def show_over_time(found: Calibration, out: IO[str] | None = None) -> None:
    """Print the ± of each parameter by averaging time, if the result has it."""
    told = found.info.get("over_time")
    if told is None:
        return
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.title, table.title_justify = "± 1σ by averaging time", "left"
    names = heading(told)
    for name in names:
        number = name not in (names[0], names[-1])
        table.add_column(name, justify="right" if number else "left")
    for row in rows(told):
        table.add_row(*row)
    console = EscapingConsole(file=out)
    console.print(table)
    for sentence in sentences(told):
        console.print(sentence, soft_wrap=True, markup=False, highlight=False)
