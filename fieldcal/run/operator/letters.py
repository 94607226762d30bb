"""Substitutes for letters that a terminal cannot show, one letter for each.

In a line of text such letters are spelled out, α as alpha. On a screen that would make
lines longer than the frame.
"""

from __future__ import annotations

from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.segment import Segment

SUBSTITUTES = {
    "α": "a", "β": "b", "γ": "g", "σ": "s", "χ": "x", "→": ">", "←": "<", "−": "-",
    "²": "2", "³": "3", "±": "~", "°": " ", "·": ".",
}  # fmt: skip
"""By letter; others become a question mark."""


@dataclass(frozen=True, slots=True)
class TerminalLetters:
    """A drawing in letters that the terminal can show.

    Attributes
    ----------
    drawing : to be shown

    """

    drawing: RenderableType

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        """Draw it, with substitutes for letters that cannot be encoded."""
        for segment in console.render(self.drawing, options):
            text = "".join(
                _substitute(letter, options.encoding) for letter in segment.text
            )
            yield Segment(text, segment.style, segment.control)


def _substitute(letter: str, encoding: str) -> str:
    try:
        letter.encode(encoding)
    except UnicodeEncodeError:
        return SUBSTITUTES.get(letter, "?")
    return letter
