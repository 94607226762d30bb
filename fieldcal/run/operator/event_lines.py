"""Standard error of a run without an operator: every line of it is an event.

Sentences that are no event of the run, such as that of a folder that was moved or of a
library, become events ``tell``. A program that reads the lines never meets another.
"""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator
from typing import TextIO

from fieldcal.run.operator.script import report_event

EVENT_START = '{"event": '
"""Beginning of a line that is an event already."""


class EventLines(io.TextIOBase):
    """Text stream that makes an event of each line that is none.

    Parameters
    ----------
    out : where the events go

    """

    def __init__(self, out: TextIO) -> None:
        self._out, self._begun = out, ""

    def write(self, text: str) -> int:
        """Write text; a line is passed on once it is complete."""
        *lines, self._begun = (self._begun + text).split("\n")
        for line in lines:
            self._pass_on(line)
        return len(text)

    def flush(self) -> None:
        """Flush what is complete."""
        self._out.flush()

    def end(self) -> None:
        """Pass on a last line that has no end."""
        rest, self._begun = self._begun, ""
        self._pass_on(rest)

    def _pass_on(self, line: str) -> None:
        if line.startswith(EVENT_START):
            self._out.write(f"{line}\n")
        elif line.strip():
            report_event("tell", self._out, text=line)


@contextlib.contextmanager
def lines_as_events() -> Iterator[None]:
    """Make an event of every line that is written to standard error meanwhile."""
    lines = EventLines(sys.stderr)
    with contextlib.redirect_stderr(lines):
        try:
            yield
        finally:
            lines.end()
