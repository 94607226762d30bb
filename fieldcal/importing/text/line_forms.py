"""Lines that are no columns as they stand: with checksums, or of messages in pieces."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from functools import reduce
from operator import xor
from typing import Self

from fieldcal.importing.text.text_form import MOSTLY, Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_top import find_separator

_CHECKED = re.compile(r"\s*[$!]?([^*]*)\*([0-9A-Fa-f]{2})\s*")
_ENTRY = re.compile(r"(\s*)(?:- )?([A-Za-z_]\w*):\s*(\S*)\s*")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

_WORD_BEFORE = re.compile(
    r"\s*\$?([A-Za-z_]\w*:|\d+(?:\.\d+)?:(?=\s))\s*([-+.\d][^:=]*[,;\s][^:=]*)"
)
"""A word, or a time, before numbers of which no other has a name."""

END_MARK = ";"
"""At the end of a line, as programs in C end theirs."""

MESSAGE_SEPARATOR = "---"
"""Line between two messages."""


class CheckedLines(TextForm):
    """Lines ``$IMU,0.1,0.2*5A`` whose end is the exclusive or of the others."""

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        return (
            cls()
            if is_true_of_most(lines, lambda line: _bare(line) is not None)
            else None
        )

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            bare = _bare(line)
            # a line that fails its check is no row: whoever reads rows says so
            return line if bare is None else bare

        return lambda lines: [one(line) for line in lines]


def _bare(line: str) -> str | None:
    """What stands before a checksum that is right; None if none is."""
    said = _CHECKED.fullmatch(line)
    if said is None or reduce(xor, said[1].encode(), 0) != int(said[2], 16):
        return None
    return said[1]


class EndedLines(TextForm):
    """Lines ``12,0.1,0.2,9.8;`` that end with a mark which parts no columns."""

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        return (
            None
            if separator == END_MARK
            else cls()
            if is_true_of_most(lines, _ends)
            else None
        )

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            return line.rstrip().removesuffix(END_MARK) if _ends(line) else line

        return lambda lines: [one(line) for line in lines]


class WordPrefix(TextForm):
    """Lines ``IMU:0.1,0.2,9.8,0,0,0``: what stands before is a cell as the others."""

    def __init__(self, separator: str) -> None:
        self._separator = separator

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        said = [one for line in lines if (one := _WORD_BEFORE.fullmatch(line))]
        if len(said) <= MOSTLY * len(lines):
            return None
        return cls(separator or find_separator(said[-1][2]) or " ")

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            said = _WORD_BEFORE.fullmatch(line)
            if said is None:
                return line
            return f"{said[1].removesuffix(':')}{self._separator}{said[2]}"

        return lambda lines: [one(line) for line in lines]


def _ends(line: str) -> bool:
    """Whether a line has the mark at its end and nowhere else."""
    return line.rstrip().find(END_MARK) == len(line.rstrip()) - 1


class EchoedMessages(TextForm):
    """Messages as ROS shows them: names and values in lines, each within the one above.

    Numbers are named with what they lie in, ``angular_velocity_x``.
    """

    gathers = True

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if its first lines are messages with an end."""
        if lines.count(MESSAGE_SEPARATOR) < 2 or not is_true_of_most(lines, _is_entry):
            return None
        messages = _Messages()
        read = [m for line in lines if (m := messages.take(line)) is not None]
        seen = Counter(name for message in read for name in message)
        names = [name for name, many in seen.items() if many > MOSTLY * len(read)]
        return cls(names) if len(names) > 2 else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        messages = _Messages()

        def read(lines: Sequence[str]) -> list[str]:
            found = (messages.take(line) for line in lines)
            return [",".join(one.get(name, "") for name in self.names)
                    for one in found if one]  # fmt: skip

        return read


class _Messages:
    """Puts lines together to messages."""

    def __init__(self) -> None:
        self._within: list[tuple[int, str]] = []
        self._message: dict[str, str] = {}

    def take(self, line: str) -> dict[str, str] | None:
        """Take a line in; return the message that it ends, if it does."""
        if line.strip() == MESSAGE_SEPARATOR:
            ended, self._message, self._within = self._message, {}, []
            return ended
        if entry := _ENTRY.fullmatch(line):
            deep, name, value = len(entry[1]), entry[2], entry[3]
            self._within = [one for one in self._within if one[0] < deep]
            if _NUMBER.fullmatch(value):
                whole = (*(name for _, name in self._within), name)
                self._message["_".join(whole)] = value
            elif not value:
                self._within.append((deep, name))
        return None


def _is_entry(line: str) -> bool:
    return line.strip() == MESSAGE_SEPARATOR or _ENTRY.match(line) is not None
