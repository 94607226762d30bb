"""Tables with a line for each value, and points of a database of time series.

0.01,ax,0.12                                   time, name, value
imu,host=pi ax=0.12,ay=0.31,az=9.8 1714746031000000000
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby
from typing import Self

from fieldcal.importing.text.text_form import (
    Reader,
    TextForm,
    is_true_of_most,
    take_row,
)
from fieldcal.importing.text.text_top import find_separator, is_number, split_cells
from fieldcal.importing.times.clock_text import is_clock
from fieldcal.importing.words.heading_words import heading_meaning

TIME = "time"
MIN_GROUPS = 4
"""Times that tell such a table."""

_POINT = re.compile(r"([^\s,]+(?:,[^\s,=]+=[^\s,]+)*) ([^\s=]+=\S+) (-?\d{9,})\s*")
_INTEGER = re.compile(r"([-+]?\d+)[iu]")


def _has_axes(names: Sequence[str]) -> bool:
    """Whether names say three axes of an accelerometer or a gyroscope."""
    said = [one for name in names if (one := heading_meaning(name)) is not None]
    return any({o.axis for o in said if o.kind == kind} == {*"xyz"} for kind in "ag")


class LongTable(TextForm):
    """A line for each value, with its time and its name: a row of those of one time."""

    gathers = True

    def __init__(
        self, names: Sequence[str], parted: str | None, head: Sequence[str]
    ) -> None:
        self.names, self._parted, self._head = (TIME, *names), parted, [*head]
        self._separator = parted or "\t"

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if all lines but one have it, and each time has as many names."""
        parted = separator or (find_separator(lines[-1]) if lines else None)
        rows = [split_cells(line, parted) for line in lines]
        head: list[str] = []
        if rows and not _is_value(rows[0]):
            head, rows = rows[0][:1], rows[1:]
        if not rows or not all(map(_is_value, rows)):
            return None
        groups = [[name for _, name, _ in some]
                  for _, some in groupby(rows, key=lambda row: row[0])]  # fmt: skip
        # the first one and the last may be cut off
        whole = groups[1:-1]
        if len(whole) < MIN_GROUPS or any({*one} != {*whole[0]} for one in whole):
            return None
        names = whole[0]
        alike = len({*names}) == len(names) and _has_axes(names)
        return cls(names, parted, head) if alike else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        row: dict[str, str] = {}

        def read(lines: Sequence[str]) -> list[str]:
            found = []
            for line in lines:
                cells = split_cells(line, self._parted)
                if not _is_value(cells):
                    # no value: whoever reads rows says so
                    found += [line] if not cells or cells[:1] != self._head else []
                    continue
                time, name, value = cells
                if row and (row[TIME] != time or name in row):
                    found.append(take_row(row, self.names, self._separator))
                row[TIME] = time
                if name in self.names:
                    row[name] = value
            if not lines and row:
                found.append(take_row(row, self.names, self._separator))
            return found

        return read


def _is_value(row: Sequence[str]) -> bool:
    """Whether cells are a time, a name and a number."""
    if len(row) != len(("time", "name", "value")):
        return False
    time, name, value = row
    told = is_number(time, False) or is_clock(time)
    return told and name[:1].isalpha() and (not value or is_number(value, False))


class DatabasePoints(TextForm):
    """Points as InfluxDB exchanges them: of one series, a row for each."""

    gathers = True

    def __init__(self, series: str, names: Sequence[str]) -> None:
        self._series, self.names = series, (*names, TIME)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines are points and one series has axes."""
        points = [said for line in lines if (said := _POINT.fullmatch(line))]
        if separator or not is_true_of_most(lines, lambda x: bool(_POINT.fullmatch(x))):
            return None
        names: dict[str, list[str]] = {}
        for said in points:
            known = names.setdefault(said[1], [])
            known += [name for name in _fields(said[2]) if name not in known]
        series = [one for one in names if _has_axes(names[one])]
        return cls(series[0], names[series[0]]) if len(series) == 1 else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def read(lines: Sequence[str]) -> list[str]:
            found = []
            for line in lines:
                said = _POINT.fullmatch(line)
                if said is None:
                    # no point, but a remark: whoever reads rows says so
                    found += [] if line.startswith("#") else [line]
                elif said[1] == self._series:
                    values = _fields(said[2]) | {TIME: said[3]}
                    found.append("\t".join(values.get(n, "") for n in self.names))
            return found

        return read


def _fields(text: str) -> dict[str, str]:
    """Values of a point by their names; an integer ends with i or u.

    >>> _fields("ax=0.1,n=5i")
    {'ax': '0.1', 'n': '5'}
    """
    pairs = (one.partition("=") for one in text.split(","))
    return {name: _INTEGER.sub(r"\1", value) for name, _, value in pairs}
