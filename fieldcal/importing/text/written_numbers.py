"""Numbers as other programs write them: Fortran's exponents, units behind each."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Self

from fieldcal.importing.text.labels import labelled_values
from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells
from fieldcal.importing.words.heading_units import parse_unit
from fieldcal.importing.words.heading_words import heading_meaning

_DOUBLE = re.compile(r"(?<![\w.])([-+]?(?:\d+\.?\d*|\.\d+))[dD]([-+]?\d{1,3})(?![\w.])")
_WITH_UNIT = re.compile(
    r"\s*\"?([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s\"].*?)\"?\s*"
)

LEAST = 0.9
"""Share of the rows in which a cell has the unit that its column has."""

MIN_ROWS = 3
"""Rows that tell a column whose cells hold units."""


class FortranNumbers(TextForm):
    """Numbers in double precision, ``0.981D+01``, as ones that all programs read."""

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have such numbers."""

        def is_so(line: str) -> bool:
            # most lines have no such letter, which is seen sooner
            return ("d" in line or "D" in line) and bool(_DOUBLE.search(line))

        return cls() if is_true_of_most(lines, is_so) else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        return lambda lines: [_DOUBLE.sub(r"\1e\2", line) for line in lines]


class UnitCells(TextForm):
    """Cells with a unit behind the number, ``9.81 m/s²``: the unit goes to the name.

    A cell in another unit than its column stays as it is, which is no number.

    Parameters
    ----------
    separator : of columns
    units : by column, as they are written

    """

    def __init__(self, separator: str, units: Mapping[int, str]) -> None:
        self._separator, self._units = separator, units

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if some columns have a unit in nearly all rows."""
        parted = separator or (find_separator(lines[-1]) if lines else None)
        if not parted or _labelled(lines[-1]):
            return None
        rows = [split_cells(line, parted) for line in lines]
        width = len(rows[-1])
        rows = [row for row in rows if len(row) == width]
        found = {i: _unit_of_most([row[i] for row in rows]) for i in range(width)}
        units = {i: unit for i, unit in found.items() if unit}
        return cls(parted, units) if units else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def one(line: str) -> str:
            row = line.split(self._separator)
            cells = {i: _WITH_UNIT.fullmatch(row[i])
                     for i in self._units if i < len(row)}  # fmt: skip
            if not any(cells.values()):
                return self._headed(row)
            for i, said in cells.items():
                if said is not None and said[2] == self._units[i]:
                    row[i] = said[1]
            return self._separator.join(row)

        return lambda lines: [one(line) for line in lines]

    def _headed(self, row: list[str]) -> str:
        """A line of names with the units of their columns."""
        for i, unit in self._units.items():
            name = row[i].strip().strip('"') if i < len(row) else ""
            if name[:1].isalpha() and not re.search(r"[\[(]", name):
                row[i] = f"{name} ({unit})"
        return self._separator.join(row)


def _labelled(line: str) -> bool:
    """Whether the values of a line have labels, which tell more than its cells."""
    names = [heading_meaning(name) for name, _ in labelled_values(line)]
    return any(one is not None and one.kind in ("a", "g") for one in names)


def _unit_of_most(cells: Sequence[str]) -> str:
    """Unit that a column has in nearly all rows; nothing if it has none."""
    least = max(MIN_ROWS, LEAST * (len(cells) - 2))
    units: Counter[str] = Counter()
    for before, cell in enumerate(cells):
        # most columns have numbers alone: no more of them are looked at than it takes
        if before - units.total() > len(cells) - least:
            return ""
        if unit := _unit_in(cell):
            units[unit] += 1
    unit, times = units.most_common(1)[0] if units else ("", 0)
    return unit if times >= least else ""


def _unit_in(cell: str) -> str:
    """Unit behind the number of a cell, as it is written; nothing of another cell.

    >>> _unit_in("9.81 m/s²"), _unit_in("9.81"), _unit_in("12:30 s")
    ('m/s²', '', '')
    """
    if is_number(cell, comma=False):
        return ""
    said = _WITH_UNIT.fullmatch(cell)
    return said[2] if said is not None and parse_unit(said[2]) else ""
