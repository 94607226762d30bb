"""Rows of several IMUs in one text, in turn, with a column that says which.

imu,t,ax,ay,az                     the column's name says that it tells devices
1,0.00,0.1,0.2,9.8                 apart, or it holds words; rows of all of them
2,0.00,0.1,0.3,9.7                 come in turn, about as many of each. Numbers without
                                   a name tell them if what stands beside differs
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.importing.text.tagged_lines import is_of_sensor
from fieldcal.importing.text.text_top import (
    find_separator,
    is_number,
    parse_numbers,
    split_cells,
)

NAMES = {"i", "id", "imu", "sensor", "instance", "device", "node", "address", "addr",
         "unit", "idx", "dev", "mac", "module", "devicename", "设备名称"}  # fmt: skip
"""Names of columns that tell devices apart, without "id" at their end."""

FEWEST_COLUMNS = 3
"""Columns behind the name of an IMU: of its axes; one of them may be a time."""

MAX_INSTANCES = 16
"""IMUs of one log."""

MIN_ROWS = 20
"""Rows of each among the first."""

BALANCE = 3.0
"""Times that one has more rows than another."""

APART, MOSTLY = 3.0, 0.8
"""Times that rows of two devices differ by more than rows of one; and the least share
of the rows that come in turn as others do, of devices that have only numbers."""

TURNS = 0.05
"""Least share of rows that are of another than the row before."""


class ImuInstances(NamedTuple):
    """Column that distinguishes several IMUs, and their names.

    Attributes
    ----------
    column : its number
    separator : of columns
    names : cells of that column, in the order in which they come
    silent : cells of those whose rows hold only zeros, which are left out

    """

    column: int
    separator: str | None
    names: tuple[str, ...]
    silent: tuple[str, ...] = ()

    @property
    def says(self) -> list[str]:
        """What the user must know, a sentence each."""
        return [f"{name} holds only zeros: it is left out" for name in self.silent]

    def over(self, pieces: Iterable[Sequence[str]]) -> ImuInstances:
        """The same by a whole file, in which one of them may come late.

        Parameters
        ----------
        pieces : its lines, some at a time

        """
        many: Counter[str] = Counter()
        live: set[str] = set()
        for lines in pieces:
            for line in lines:
                row = line.split(self.separator)
                if len(row) <= self.column:
                    continue
                name = row[self.column].strip().strip('"')
                many[name] += 1
                if name not in live and _moves(row[self.column + 1 :]):
                    live.add(name)
        late = [n for n in many if n in live and many[n] >= MIN_ROWS]
        names = dict.fromkeys((*self.names, *late))
        silent = tuple(name for name in self.silent if name not in names)
        return self._replace(names=tuple(names), silent=silent)

    def only(self, name: str, lines: Sequence[str]) -> list[str]:
        """Lines of one IMU, and those that are none of any."""
        return [line for line in lines if self._cell(line) in (name, None)]

    def _cell(self, line: str) -> str | None:
        row = line.split(self.separator)
        cell = row[self.column].strip().strip('"') if len(row) > self.column else ""
        return cell if cell in (*self.names, *self.silent) else None


def find_instances(lines: Sequence[str], separator: str | None) -> ImuInstances | None:
    """Find the column that distinguishes several IMUs; None for a single IMU."""
    if not lines:
        return None
    parted = separator or find_separator(lines[-1])
    rows = [split_cells(line, parted) for line in lines]
    width = len(rows[-1])
    whole = [row for row in rows if len(row) == width]
    numbers: list[list[str]] = []
    above: list[list[str]] = []
    for row in whole:
        values = sum(is_number(cell, parted != ",") for cell in row)
        (numbers if values > 1 else above).append(row)
    for i in range(width):
        column = [row[i] for row in numbers]
        named = any(tells_devices(row[i]) for row in above)
        words = not any(is_number(cell, False) for cell in column)
        numbered = not above and _numbers_devices(numbers, i, parted)
        if (
            (named or words or numbered)
            and _in_turn(column)
            and not _are_sensors(column)
        ):
            names = dict.fromkeys(column)
            zeros = [name for name in names if _is_silent(numbers, i, name)]
            silent = zeros if len(zeros) < len(names) else []
            live = tuple(name for name in names if name not in silent)
            return ImuInstances(i, parted, live, tuple(silent))
    return None


def _numbers_devices(
    rows: Sequence[Sequence[str]], i: int, separator: str | None
) -> bool:
    """Whether a column without a name numbers devices that come one after the other.

    Each differs from the row before, which is of another device, by far more than from
    its own row before. Of a counter that begins again and again it is otherwise.
    """
    column = [row[i] for row in rows]
    many = len({*column})
    if not 1 < many <= MAX_INSTANCES or not all(map(str.isdigit, {*column})):
        return False
    again = sum(a == b for a, b in zip(column, column[many:], strict=False))
    if again < MOSTLY * len(column):
        return False
    table = parse_numbers([(separator or " ").join(row) for row in rows], separator)
    beside, own = (np.median(np.abs(table[n:] - table[:-n]), axis=0)
                   for n in (1, many))  # fmt: skip
    return int((beside > APART * own).sum()) >= FEWEST_COLUMNS


def tells_devices(name: str) -> bool:
    """Whether a name is that of a column or field that identifies devices."""
    bare = re.sub(r"[\s_.-]+", "", name.lower().lstrip("#%/ "))
    return bare in NAMES or (bare.endswith("id") and bare[:-2] in NAMES)


def _are_sensors(column: Sequence[str]) -> bool:
    """Whether cells name the two sensors of one IMU."""
    words = {*column}
    return all(any(is_of_sensor(w, kind, words) for w in words) for kind in "ag")


def _moves(cells: Sequence[str]) -> bool:
    """Whether cells of a row hold numbers of axes that are there."""
    numbers = [float(cell) for cell in cells if is_number(cell, False)]
    return len(numbers) >= FEWEST_COLUMNS and sum(map(bool, numbers)) > 1


def _is_silent(rows: Sequence[Sequence[str]], i: int, name: str) -> bool:
    """Whether the axes of an IMU hold only zeros, as those of one that is not there."""
    own = [row[i + 1 :] for row in rows if row[i] == name]
    zeros = [all(is_number(cell, False) and float(cell) == 0 for cell in cells)
             for cells in zip(*own, strict=True)]  # fmt: skip
    return len(zeros) >= FEWEST_COLUMNS and sum(zeros) >= len(zeros) - 1


def _in_turn(column: Sequence[str]) -> bool:
    """Whether cells change from row to row between a few, about as many of each."""
    many = Counter(column)
    if not 1 < len(many) <= MAX_INSTANCES or "" in many:
        return False
    most, least = max(many.values()), min(many.values())
    changes = sum(a != b for a, b in zip(column, column[1:], strict=False))
    turns = changes > TURNS * len(column)
    return turns and least >= MIN_ROWS and most <= BALANCE * least
