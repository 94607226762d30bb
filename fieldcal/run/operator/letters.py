"""Letters for a screen whose terminal lacks some: one for one, so that nothing shifts.

In a line of text they are spelled, α as alpha; on a screen that would push the frame
out and the first lines up.
"""

from __future__ import annotations

from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.segment import Segment

ALIKE = {
    "α": "a", "β": "b", "γ": "g", "σ": "s", "χ": "x", "→": ">", "←": "<", "−": "-",
    "²": "2", "³": "3", "±": "~", "°": " ", "·": ".",
}  # fmt: skip
"""By letter; others become a question mark."""


@dataclass(frozen=True, slots=True)
class TerminalLetters:
    """A drawing in letters that the terminal can show.

    Attributes
    ----------
    drawn : what is to be shown

    """

    drawn: RenderableType

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        """Draw it, and put others in the place of letters that cannot be sent."""
        for segment in console.render(self.drawn, options):
            text = "".join(
                _sendable(letter, options.encoding) for letter in segment.text
            )
            yield Segment(text, segment.style, segment.control)


def _sendable(letter: str, encoding: str) -> str:
    try:
        letter.encode(encoding)
    except UnicodeEncodeError:
        return ALIKE.get(letter, "?")
    return letter
