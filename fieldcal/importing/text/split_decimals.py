"""Decimal commas in a text whose columns are parted by commas as well.

time,ax,ay,az            a name less than cells: the time is 12,345
12,345,0.1,0.2,9.8
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Self

from fieldcal.importing.text.text_form import MOSTLY, Reader, TextForm
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells

WHOLE = re.compile(r"[-+]?\d+")
PART = re.compile(r"\d{1,9}")
"""Digits before the comma, and behind it."""

STAYS = 0.3
"""Share of the rows in which what is before the comma stays: a counter does not."""

MIN_ROWS = 4
"""Rows that tell where the comma is."""


class SplitDecimals(TextForm):
    """Rows of which the numbers of one column, or of all, are in two cells each."""

    def __init__(self, places: Sequence[int], width: int) -> None:
        self._places, self._width = {*places}, width
        self.says = (
            "its commas are between columns and decimal commas as well: cells"
            f" {places[0] + 1} and {places[0] + 2} are one number"
            + (", and so on" if len(places) > 1 else "")
        )

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if the line of names is shorter than most rows by such cells."""
        if separator not in (None, ",") or not lines:
            return None
        if find_separator(lines[-1]) != ",":
            return None
        rows = [split_cells(line, ",") for line in lines]
        # how whole numbers are written, nobody knows: the widest rows are whole
        width = max(len(row) for row in rows[-max(MIN_ROWS, len(rows) // 2) :])
        full = [row for row in rows if len(row) == width and is_number(row[0], False)]
        names = [
            row for row in rows if row and not any(is_number(c, False) for c in row)
        ]
        if len(full) < MIN_ROWS or len(full) <= MOSTLY * len(rows) or not names:
            return None
        many = len(names[-1])
        if width == 2 * many:
            places = [*range(0, width, 2)]
            fits = all(_are_parts(full, i) for i in places)
            return cls(places, width) if fits else None
        found = [i for i in range(width - 1) if _are_parts(full, i)]
        own = [i for i in found if _goes_on(full, i)]
        return cls(own, width) if width == many + 1 and len(own) == 1 else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            row = line.split(",")
            if len(row) != self._width:
                # whole numbers without a comma, or no row: whoever reads rows says so
                return line
            ends = ["." if i in self._places else "," for i in range(len(row))]
            cells = zip(row, [*ends[:-1], ""], strict=True)
            return "".join(f"{cell.strip()}{end}" for cell, end in cells)

        return lambda lines: [one(line) for line in lines]


def _are_parts(rows: Sequence[Sequence[str]], i: int) -> bool:
    """Whether a cell of each row and the one behind it may be one number."""
    return all(WHOLE.fullmatch(row[i]) and PART.fullmatch(row[i + 1]) for row in rows)


def _goes_on(rows: Sequence[Sequence[str]], i: int) -> bool:
    """Whether what is before the comma is no counter of rows."""
    whole = [row[i] for row in rows]
    return sum(a == b for a, b in pairwise(whole)) >= STAYS * (len(whole) - 1)
