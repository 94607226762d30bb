"""Whole numbers whose thousands are set apart, as spreadsheets show them.

    "1,714,746"    1.714.746    1 714 746    1'714'746

A comma or a point may as well be that of a decimal number. In one column a program
writes so many digits behind it in all rows, or leaves zeros at the end away; thousands
have three digits behind it in numbers from 1000 on, and none in smaller ones.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Self

from fieldcal.importing.text.text_form import Reader, TextForm
from fieldcal.importing.text.text_lines import split_quoted
from fieldcal.importing.text.text_top import find_separator, is_number

SIGNS = (",", ".", " ", "'", "’", "\u00a0", "\u2009", "\u202f")
"""What parts thousands; spaces may be ones that break no line, or narrow."""

EITHER = ",."
"""Those that may part decimals."""

FEWEST = 3
"""Numbers without a sign that tell thousands, and numbers that have it."""

MANY = 1000.0
"""From which numbers on there is a sign."""

_DIGIT = re.compile(r"\s*[-+]?\d")

_GROUP = {
    sign: re.compile(rf"{re.escape(sign)}(?<=\d.)\d{{3}}(?!\d)") for sign in SIGNS
}
"""A sign behind a digit, and a group of three digits: signs are few, digits many."""


class GroupedDigits(TextForm):
    """Columns of whole numbers whose thousands are parted.

    Parameters
    ----------
    old, new : separator of columns, and what parts them once no cell is in quotes
    signs : between thousands, by column

    """

    def __init__(self, old: str, new: str, signs: Mapping[int, str]) -> None:
        self._old, self._new, self._signs = old, new, signs
        first = min(signs)
        self.says = (
            f"{signs[first]!r} in its column {first + 1} is taken for the sign between"
            " thousands"
        )

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if a column has such numbers."""
        text = "\n".join(lines)
        # most texts have none anywhere, which is seen sooner than cell by cell
        may = [s for s in SIGNS if len(_GROUP[s].findall(text)) >= FEWEST]
        if not may:
            return None
        old = separator or find_separator(re.sub('"[^"]*"', '""', lines[-1]))
        if old is None:
            return None
        rows = [split_quoted(line, old) for line in lines]
        width = len(rows[-1])
        columns = [*zip(*(row for row in rows if len(row) == width), strict=True)]
        found = {i: _sign(column, may) for i, column in enumerate(columns)}
        signs = {i: sign for i, sign in found.items() if sign}
        quoted = any('"' in line for line in lines)
        return (
            cls(old, (separator or "\t") if quoted else old, signs) if signs else None
        )

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            row = split_quoted(line, self._old)
            for i, sign in self._signs.items():
                if i < len(row) and _groups(row[i], sign):
                    row[i] = row[i].replace(sign, "")
            return self._new.join(row)

        return lambda lines: [one(line) for line in lines]


def _sign(cells: Sequence[str], signs: Sequence[str] = SIGNS) -> str:
    """Which sign parts the thousands of the numbers of a column; "" if none does.

    >>> _sign(["t", "980", "990", "998", "1,000", "1,010", "1,020"])
    ','
    >>> _sign(["9.812", "9.790", "9.833", "0.120"]), _sign(["1'000'000"] * 3)
    ('', "'")
    """
    for sign in signs:
        groups = [_groups(cell, sign) for cell in cells]
        grouped = sum(map(bool, groups))
        if grouped < FEWEST:
            continue
        others = [c for c, many in zip(cells, groups, strict=True) if not many]
        numbers = [cell for cell in others if _DIGIT.match(cell)]
        if not all(_is_small(cell, sign) for cell in numbers):
            continue
        if sign not in EITHER or max(groups) > 1 or len(numbers) >= FEWEST:
            return sign
    return ""


def _groups(cell: str, sign: str) -> int:
    """How many groups of three digits stand behind a sign; 0 of other cells.

    >>> [_groups(cell, ",") for cell in ("1,714,746", "-16,384", "0,123", "16384")]
    [2, 1, 0, 0]
    """
    cell = cell.strip().lstrip("+-")
    if sign not in cell:
        return 0
    first, *others = cell.split(sign)
    *whole, last = others
    decimals = re.fullmatch(r"(\d{3})(?:[.,]\d+)?", last)
    begins = re.fullmatch(r"[1-9]\d{0,2}", first) is not None
    fits = decimals is not None and all(re.fullmatch(r"\d{3}", one) for one in whole)
    return len(others) if begins and fits else 0


def _is_small(cell: str, sign: str) -> bool:
    """Whether a cell is a number without thousands, or decimals behind such a sign."""
    number = sign not in cell and is_number(cell, comma=True)
    return number and abs(float(cell.replace(",", "."))) < MANY
