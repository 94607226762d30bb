"""What a form of a text is: how its lines become lines of plain columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Self

MOSTLY = 0.5
"""Share of lines that tell the form of a text."""

Reader = Callable[[Sequence[str]], list[str]]
"""Turns lines into lines; called with one piece of a text after the other, and with no
lines where the text ends."""


class TextForm(ABC):
    """A form of a text.

    Attributes
    ----------
    names : of its columns, where its lines say them; else empty
    clock : number of the column whose clock is read, or None
    days : that its first row may be of, where its clock has a date
    gathers : whether rows are not simply lines
    says : what the user must know, or nothing

    """

    names: tuple[str, ...] = ()
    clock: int | None = None
    days: tuple[int, ...] = ()
    gathers = False
    says = ""

    @classmethod
    @abstractmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """Return the form, if these first lines have it.

        Parameters
        ----------
        lines : that are not empty
        separator : of columns, where the user says it

        """

    @abstractmethod
    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""


def is_true_of_most(lines: Sequence[str], is_so: Callable[[str], bool]) -> bool:
    """Whether a condition is true of most lines, looking at no more than it takes."""
    wanted, found = MOSTLY * len(lines), 0
    for behind, line in zip(reversed(range(len(lines))), lines, strict=True):
        found += is_so(line)
        if found > wanted or found + behind <= wanted:
            break
    return found > wanted


def take_row(row: dict[str, str], names: Sequence[str], separator: str) -> str:
    """Text of the values that were gathered for a row, which is empty then.

    >>> row = {"ax": "0.1", "t": "3"}
    >>> take_row(row, ("t", "ax", "ay"), ","), row
    ('3,0.1,', {})
    """
    text = separator.join(row.get(name, "") for name in names)
    row.clear()
    return text
