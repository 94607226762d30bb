"""Rows of a matrix as programs and databases write it, each within brackets.

{0.00f, 0.1f, 0.2f, 9.8f},         an array in C; its ends are lines of signs alone
array([[0.00, 0.1, 0.2, 9.8],      NumPy's
INSERT INTO imu (t, ax) VALUES     values of SQL, whose names stand before them or
(0.00, 0.1, 0.2, 9.8),             where the table is made
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most

_NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?[fFL]?|nan|NaN|NULL)"
_ROW = re.compile(
    r"\s*(?:INSERT\b.*?\bVALUES|[\w .\[\]]*=|(?:np\.|numpy\.)?array)?"
    rf"[\s(\[{{]*[(\[{{]\s*({_NUMBER}(?:(?:\s*[,;]\s*|\s+){_NUMBER}){{2,}})"
    r"\s*,?\s*[)\]}][\s)\]},;]*",
    re.IGNORECASE,
)
"""The numbers of a row, whatever brackets it stands in."""

_SIGNS = re.compile(r"[\s()\[\]{},;]*")
_SUFFIX = re.compile(r"(?<=[\d.])[fFL]\b")
_PARTED = re.compile(r"\s*[,;]\s*|\s+")

_INSERTED = re.compile(r"INSERT\b[^(]*\(([^()]*)\)\s*VALUES", re.IGNORECASE)
_MADE = re.compile(
    r"[`\"]?(\w+)[`\"]?\s+(?:double|float|real|decimal|numeric|(?:big|small|tiny)?int"
    r"|timestamp|datetime)",
    re.IGNORECASE,
)
"""Names of the columns of a table of SQL: where rows are put in, where it is made."""


class MatrixRows(TextForm):
    """Rows of numbers, each within brackets.

    Attributes
    ----------
    names : of the columns, where SQL says them; else empty

    """

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        if not is_true_of_most(lines, lambda line: _cells(line) is not None):
            return None
        rows = (cells for line in lines if (cells := _cells(line)) is not None)
        return cls(_sql_names(lines, len(next(rows))))

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        return lambda lines: [*without_brackets(lines)]


def without_brackets(lines: Iterable[str]) -> Iterator[str]:
    """Lines of which the rows of a matrix are numbers with commas between."""
    for line in lines:
        cells = _cells(line)
        if cells is not None:
            yield ",".join(cells)
        elif _SIGNS.fullmatch(line) is None:
            yield line


def _cells(line: str) -> list[str] | None:
    """Numbers of a row; None of another line."""
    said = _ROW.fullmatch(line)
    return None if said is None else _PARTED.split(_SUFFIX.sub("", said[1]))


def _sql_names(lines: Sequence[str], width: int) -> list[str]:
    """Names of so many columns, as SQL says them; none if it does not."""
    inserted = next(filter(None, map(_INSERTED.match, lines)), None)
    if inserted is not None:
        names = [name.strip(" `\"'") for name in inserted[1].split(",")]
    else:
        above = [line for line in lines if _cells(line) is None]
        names = [name for line in above for name in _MADE.findall(line)]
    return names if len(names) == width else []
