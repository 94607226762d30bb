"""Console that shows control characters and markup in foreign text as characters."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import IO, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from fieldcal.commands.row_lists import as_row_lists, cuts_cells
from fieldcal.commands.spelling import spell
from fieldcal.core.escaping import discard_output, escape_invisible


class EscapingConsole(Console):
    """A rich console without markup and highlighting, which escapes control characters.

    It takes the options of `rich.console.Console`. Letters that the terminal cannot
    show are spelled out before lines are broken and columns measured, as this makes
    them longer.

    Parameters
    ----------
    file, stderr, options : as of `rich.console.Console`
    spelled : whether letters are spelled out, and not left to who draws them

    """

    def __init__(
        self,
        file: IO[str] | None = None,
        stderr: bool = False,
        spelled: bool = True,
        **options: Any,
    ) -> None:
        stream = file or (sys.stderr if stderr else sys.stdout)
        below = getattr(stream, "rich_proxied_file", stream)
        super().__init__(file=below, markup=False, highlight=False, **options)
        self._spells = spelled and not self.encoding.startswith("utf")

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text of letters that can be shown."""
        shown = spell(text, self.encoding) if self._spells else text
        return super().render_str(shown, **options)

    def _with_known_letters(self, text: Text) -> Text:
        """A text, styles included, in letters that can be shown."""
        if spell(text.plain, self.encoding) == text.plain:
            return text
        out = text.blank_copy()
        for i in range(len(text)):
            piece = text[i]
            letters = Text(spell(piece.plain, self.encoding), piece.style)
            for span in piece.spans:
                letters.stylize(span.style)
            out.append_text(letters)
        return out

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render, with the text of each segment escaped by `shown`.

        A table whose cells do not fit is rendered as a list of its rows.
        """
        if self._spells and isinstance(renderable, Text):
            renderable = self._with_known_letters(renderable)
        drawn = super().render(renderable, options)
        if isinstance(renderable, Table):
            drawn = list(drawn)
            width = (options or self.options).max_width
            if cuts_cells(renderable, drawn, width):
                drawn = super().render(as_row_lists(renderable), options)
        for segment in drawn:
            if segment.control:
                yield segment
            else:
                yield Segment(escape_invisible(segment.text), segment.style)

    def on_broken_pipe(self) -> None:
        """Continue without output, so that the exit code is still right."""
        self.quiet = True
        discard_output(self.file)
