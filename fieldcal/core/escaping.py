r"""Escape invisible characters, so that a terminal or an XML file shows foreign text.

Names of positions, serial numbers, topics and arrays come from files. A terminal
carries out control sequences in them: colours, titles, links, the direction of writing.
So invisible characters are replaced by their numbers.

>>> print(escape_invisible("\x1b]0;GO\x07 \u202e5"))
\x1b]0;GO\x07 \u202e5
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterable
from typing import IO, Any

NOT_PLAIN = re.compile(r"[^\t\n\x20-\x7e]")
"""Characters that may be invisible: all but printable ASCII, tab and newline."""

INVISIBLE_CATEGORIES = ("Cc", "Cf", "Cs", "Cn", "Zl", "Zp")
"""Unicode categories of invisible characters."""


def escape_invisible(text: str) -> str:
    r"""Text with invisible characters, except newlines and tabs, shown as numbers.

    >>> escape_invisible("α = 45°\n"), escape_invisible("a\rb")
    ('α = 45°\n', 'a\\x0db')
    """
    return NOT_PLAIN.sub(_number, text)


def escape_line(text: str) -> str:
    r"""Text as `escape_invisible` returns it, with newlines and tabs escaped as well.

    >>> escape_line("left\nGO")
    'left\\x0aGO'
    """
    return escape_invisible(text).replace("\n", r"\x0a").replace("\t", r"\x09")


def _number(match: re.Match[str]) -> str:
    letter = match.group()
    if unicodedata.category(letter) not in INVISIBLE_CATEGORIES:
        return letter
    code = ord(letter)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def discard_output(stream: IO[str]) -> None:
    """Redirect what a stream still has, and all to come, to nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


class EscapingStream:
    """Output stream that escapes invisible characters.

    If its reader goes, the rest is discarded: a command goes on, and its exit code is
    what it finds.

    Parameters
    ----------
    below : stream that receives the escaped text

    """

    def __init__(self, below: IO[str]) -> None:
        self.rich_proxied_file = below
        """Stream to which rich writes what it has rendered; not escaped."""

    def write(self, text: str) -> int:
        """Write text as `escape_invisible` returns it."""
        try:
            return self.rich_proxied_file.write(escape_invisible(text))
        except BrokenPipeError:
            discard_output(self.rich_proxied_file)
            return len(text)

    def flush(self) -> None:
        """Flush what was written."""
        try:
            self.rich_proxied_file.flush()
        except BrokenPipeError:
            discard_output(self.rich_proxied_file)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write several lines."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)
