"""Console that shows control characters and markup in foreign text as characters."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from typing import IO, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from fieldcal.core.escaping import escape_invisible


class EscapingConsole(Console):
    """A rich console without markup and highlighting, which escapes control characters.

    It takes the options of `rich.console.Console`.
    """

    def __init__(
        self, file: IO[str] | None = None, stderr: bool = False, **options: Any
    ) -> None:
        stream = file or (sys.stderr if stderr else sys.stdout)
        below = getattr(stream, "rich_proxied_file", stream)
        super().__init__(file=below, markup=False, highlight=False, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render, with the text of each segment escaped by `shown`."""
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(escape_invisible(segment.text), segment.style)

    def on_broken_pipe(self) -> None:
        """Continue without output, so that the exit code is still right."""
        self.quiet = True
        discard_output()


def discard_output() -> None:
    """Redirect standard output to nowhere, since its reader is gone."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
