r"""Text of others as a terminal or an XML file may have it: none of it is carried out.

Names of positions, serial numbers, topics and arrays come from files. A terminal obeys
what it finds among them: colours, titles, links, the order of writing. So characters
that are not to be seen are shown by their numbers.

>>> print(shown("\x1b]0;GO\x07 \u202e5"))
\x1b]0;GO\x07 \u202e5
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from typing import IO, Any

SUSPECT = re.compile(r"[^\t\n\x20-\x7e]")
"""What has to be looked at: all but plain text."""

UNSEEN = ("Cc", "Cf", "Cs", "Cn", "Zl", "Zp")
"""Kinds of characters that are not to be seen."""


def shown(text: str) -> str:
    r"""Text with what is not to be seen in it by its numbers; lines and tabs stay.

    >>> shown("α = 45°\n"), shown("a\rb")
    ('α = 45°\n', 'a\\x0db')
    """
    return SUSPECT.sub(_number, text)


def one_line(text: str) -> str:
    r"""Return the same for a name: it cannot begin a line either.

    >>> one_line("left\nGO")
    'left\\x0aGO'
    """
    return shown(text).replace("\n", r"\x0a").replace("\t", r"\x09")


def _number(match: re.Match[str]) -> str:
    letter = match.group()
    if unicodedata.category(letter) not in UNSEEN:
        return letter
    code = ord(letter)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


class ShownStream:
    """Standard output or error on which nothing is carried out.

    Parameters
    ----------
    below : where it goes

    """

    def __init__(self, below: IO[str]) -> None:
        self.rich_proxied_file = below
        """Where rich writes what it has rendered, which is not shown but done."""

    def write(self, text: str) -> int:
        """Write text as `shown`."""
        return self.rich_proxied_file.write(shown(text))

    def writelines(self, lines: Iterable[str]) -> None:
        """Write several."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)
