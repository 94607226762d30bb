"""What a terminal shows while a command works: a line, or a bar over many sessions.

Nothing of it stays when the work is done. A program that reads standard error, or the
output of --json, gets nothing of the line.
"""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable, Iterator
from time import monotonic
from typing import TYPE_CHECKING

from fieldcal.core.escaping import escape_line

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from fieldcal.fleet.batch import SessionBatch
    from fieldcal.fleet.workers import WorkerPool

SHOWN_AFTER_S = 2.0
"""Time after which the line is shown: what is quicker needs none, s."""

NOTE_INTERVAL = 60.0
"""Time between lines about the progress where no bar can be drawn, s."""

QUIET_OPTIONS = ("json", "plain", "headless")
"""Options of commands whose reader wants no line that comes and goes."""

SEARCH = "searching for the effects that explain"
"""What takes most of the time of a solve and a diagnosis; the session is named next."""


class WorkLine:
    """Text of the line: what is being done, and for how long.

    Parameters
    ----------
    what : what is being done
    clock : time, s

    """

    def __init__(self, what: str, clock: Callable[[], float] = monotonic) -> None:
        self._what, self._clock, self._begun = escape_line(what), clock, clock()

    def __rich__(self) -> Text:
        """The line; empty as long as it is not due."""
        from rich.text import Text

        took = self._clock() - self._begun
        shown = f"{self._what}, {took:.0f} s so far" if took >= SHOWN_AFTER_S else ""
        return Text(shown, no_wrap=True, overflow="ellipsis")


@contextlib.contextmanager
def show_work(
    args: argparse.Namespace,
    what: str,
    console: Console | None = None,
    clock: Callable[[], float] = monotonic,
) -> Iterator[None]:
    """Show on a terminal what is being done, while it lasts.

    Parameters
    ----------
    args : options of the command
    what : what is being done
    console : where to show it; standard error unless given
    clock : time, s

    """
    from fieldcal.commands.console import EscapingConsole

    console = console or EscapingConsole(stderr=True)
    quiet = any(getattr(args, option, False) for option in QUIET_OPTIONS)
    if quiet or not console.is_terminal or console.is_dumb_terminal:
        yield
        return
    from rich.live import Live

    # what is written to standard error meanwhile appears above the line
    line = WorkLine(what, clock)
    with Live(line, console=console, transient=True, redirect_stdout=False):
        yield


def process_with_progress(
    batch: SessionBatch, left: list[str], pool: WorkerPool
) -> None:
    """Process the folders `left`, with a bar that shows rate and remaining time.

    In a log file, where a bar cannot be drawn, a line tells them now and then.
    """
    from rich import progress

    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole(stderr=True)
    bar = progress.Progress(
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TextColumn("{task.fields[rate]}"),
        progress.TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,  # it would leave an empty line
    )
    with bar, contextlib.closing(batch.process(left, pool)) as done:
        task = bar.add_task("", total=len(left), rate="")
        begun = noted = monotonic()
        for number, one in enumerate(done, 1):
            bar.update(task, advance=1)
            speed = bar.tasks[0].speed
            if speed:
                bar.update(task, rate=f"{60 * speed:.3g} a minute")
            if one.error:
                bar.console.print(escape_line(one.error), soft_wrap=True)
            now = monotonic()
            if not bar.console.is_terminal and now - noted >= NOTE_INTERVAL:
                noted, each = now, (now - begun) / number / 60
                bar.console.print(
                    f"{number} of {len(left)} sessions done,"
                    f" about {each * (len(left) - number):.0f} min left"
                )
