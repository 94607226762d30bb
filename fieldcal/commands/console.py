"""A console that shows what is in names and sentences, and carries out none of it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from typing import IO, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from fieldcal.core.escaping import escape_invisible


class ShownConsole(Console):
    """A console without markup or highlighting; takes what rich's takes."""

    def __init__(
        self, file: IO[str] | None = None, stderr: bool = False, **options: Any
    ) -> None:
        stream = file or (sys.stderr if stderr else sys.stdout)
        below = getattr(stream, "rich_proxied_file", stream)
        super().__init__(file=below, markup=False, highlight=False, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render, with the text of each segment as `escape_invisible` returns it."""
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(escape_invisible(segment.text), segment.style)

    def on_broken_pipe(self) -> None:
        """Go on for nobody: whoever read the first line only has the exit code too."""
        self.quiet = True
        unread()


def unread() -> None:
    """Have standard output go nowhere from here on: its reader is gone."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
