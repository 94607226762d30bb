"""Rows in which each value stands behind a cell with its name.

    AcX,123,AcY,-45,AcZ,16384
    2024-05-03T14:20:31.009,FE,1C,1,mavlink_raw_imu_t,time_usec,5020000,xacc,12,yacc,3,...

The second are messages of MAVLink as a ground station writes them: of several kinds of
rows, that which names the sensors is taken.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from typing import NamedTuple, Self

from fieldcal.importing.text.log_prefixes import TIME
from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_lines import MISSING
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells
from fieldcal.importing.times.clock_text import is_clock
from fieldcal.importing.words.heading_words import heading_meaning

FEWEST = 3
"""Names of a row: the axes of a sensor."""

_NAME = re.compile(r"[^\W\d][\w .\[\]()-]*")


class NamedCells(NamedTuple):
    """Values of a row with their names.

    Attributes
    ----------
    names, values : in their order
    clock : a time of day that stands before them, or nothing

    """

    names: tuple[str, ...]
    values: tuple[str, ...]
    clock: str


class PairedCells(TextForm):
    """Rows of names and values, of which those of the sensors are taken.

    Parameters
    ----------
    separator : of cells
    wanted : names of a row that is taken
    clocked : whether the time of such a row stands before its names alone
    others : whether there are rows with other names

    """

    gathers = True

    def __init__(
        self, separator: str, wanted: tuple[str, ...], clocked: bool, others: bool
    ) -> None:
        self._separator, self._wanted, self._clocked = separator, wanted, clocked
        self.names = (TIME, *wanted) if clocked else wanted
        if others:
            shown = ", ".join(wanted[:FEWEST])
            self.says = f"of its rows, those that name {shown} … are taken"

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it, and some name the axes of a sensor."""
        seen = Counter(find_separator(line) for line in lines)
        parted = separator or (seen.most_common(1)[0][0] if seen else None)
        if parted is None or not is_true_of_most(
            lines, lambda line: _named(line, parted) is not None
        ):
            return None
        rows = [row for line in lines if (row := _named(line, parted)) is not None]
        many = Counter(row.names for row in rows)
        wanted = max(many, key=lambda names: (_count(names, "ag"), many[names]))
        if _count(wanted, "ag") < FEWEST:
            return None
        clocks = all(row.clock for row in rows if row.names == wanted)
        clocked = clocks and not _count(wanted, ("t", "dt"))
        return cls(parted, wanted, clocked, len(many) > 1)

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def read(lines: Sequence[str]) -> list[str]:
            found = []
            for line in lines:
                row = _named(line, self._separator)
                if row is None:
                    # no row: whoever reads rows says so
                    found.append(line)
                elif row.names == self._wanted:
                    clock = [row.clock] if self._clocked else []
                    found.append(self._separator.join([*clock, *row.values]))
            return found

        return read


def _named(line: str, separator: str) -> NamedCells | None:
    """Values of a row and their names; None of a row that has none.

    >>> _named("x,1,imu_t,ax,0.1,ay,0.2,az,9.8,,Len,3", ",").names
    ('ax', 'ay', 'az')
    """
    cells = split_cells(line, separator)
    for first in range(len(cells) - 2 * FEWEST + 1):
        last = first
        while last + 1 < len(cells) and _is_pair(*cells[last : last + 2]):
            last += 2
        names = tuple(cells[first:last:2])
        if len({*names}) == len(names) >= FEWEST:
            before = (cell for cell in cells[:first] if is_clock(cell))
            return NamedCells(
                names, tuple(cells[first + 1 : last : 2]), next(before, "")
            )
    return None


def _is_pair(name: str, value: str) -> bool:
    """Whether two cells are a name and its value."""
    named = _NAME.fullmatch(name) is not None and name not in MISSING
    return named and (is_number(value, False) or value in MISSING[1:])


def _count(names: Sequence[str], kinds: Collection[str]) -> int:
    """How many names say a channel of some kinds."""
    said = [heading_meaning(name) for name in names]
    return sum(one is not None and one.kind in kinds for one in said)
