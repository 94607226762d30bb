"""Rows of several IMUs in one text, with a column that says which.

imu,t,ax,ay,az                     the column's name says that it tells devices
1,0.00,0.1,0.2,9.8                 apart, or it holds words; rows of all of them
2,0.00,0.1,0.3,9.7                 come in turn, about as many of each. Numbers without
                                   a name tell them if what stands beside differs

t,ax,ay,az,device                  where the rows of one device come behind those of
0.00,0.1,0.2,9.8,left              another, only the column's name tells; of several
…                                  such columns the first that is not the same in all
0.00,0.1,0.3,9.7,right             rows, those that name devices before those that name
                                   who wore them
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from fieldcal.importing.text.tagged_lines import is_of_sensor
from fieldcal.importing.text.text_top import (
    find_separator,
    is_number,
    parse_numbers,
    split_cells,
    with_points,
)
from fieldcal.importing.times.name_changes import NameChanges
from fieldcal.importing.words.device_names import (
    may_count,
    tells_devices,
    tells_wearers,
)

FEWEST_COLUMNS = 3
"""Columns behind the name of an IMU: of its axes; one of them may be a time."""

MAX_INSTANCES = 16
"""IMUs of one log whose rows come in turn."""

MAX_NAMED = 100
"""IMUs of a file that a column tells apart by its name: what has more values counts."""

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
    clock : number of a column that grows from row to row, or None
    few : cells of those that have hardly any rows, which are left out

    """

    column: int
    separator: str | None
    names: tuple[str, ...]
    silent: tuple[str, ...] = ()
    clock: int | None = None
    few: tuple[str, ...] = ()

    @property
    def says(self) -> list[str]:
        """What the user must know, a sentence each."""
        return [
            *(f"{name} holds only zeros: it is left out" for name in self.silent),
            *(f"{name} has fewer than {MIN_ROWS} rows: it is left out"
              for name in self.few),
        ]  # fmt: skip

    def over(self, pieces: Iterable[Sequence[str]]) -> ImuInstances:
        """The same by a whole file, in which one of them may come late.

        Parameters
        ----------
        pieces : its lines, some at a time

        """
        many: Counter[str] = Counter()
        live: set[str] = set()
        changes = NameChanges()
        for lines in pieces:
            if not lines:
                continue
            only = self._only_name(lines)
            first, last = (self._time(lines[i]) for i in (0, -1))
            if only in live and first is not None and last is not None:
                # of a long file with one device, most pieces
                many[only] += len(lines)
                changes.skip(only, first, last, len(lines))
                continue
            said, times = list[str](), list[float]()
            for line in lines:
                row = line.split(self.separator)
                if len(row) <= self.column:
                    continue
                name = row[self.column].strip().strip('"')
                many[name] += 1
                if name not in live and _moves(self._beside(row)):
                    live.add(name)
                if (since := self._time(line)) is not None:
                    said.append(name)
                    times.append(since)
            changes.feed(np.array(said), np.array(times))
        if changes.go_on:
            return self._replace(names=self.names[:1])
        late = [n for n in many if n in live and many[n] >= MIN_ROWS]
        names = dict.fromkeys((*self.names, *late))
        silent = tuple(name for name in self.silent if name not in names)
        few = tuple(n for n in many if n in live and n not in names)
        return self._replace(names=tuple(names), silent=silent, few=few)

    @property
    def are_several(self) -> bool:
        """Whether the cells name several devices, and not the sensors of one."""
        known = [*self.names, *self.silent, *self.few]
        several = 1 < len(known) <= MAX_NAMED and bool(self.names)
        return several and "" not in known and not _are_sensors(known)

    def _only_name(self, lines: Sequence[str]) -> str:
        """Name in all lines; "" where they differ."""
        places = (line.split(self.separator, self.column + 1) for line in lines)
        found = {row[self.column] if len(row) > self.column else "" for row in places}
        return found.pop().strip().strip('"') if len(found) == 1 else ""

    def _time(self, line: str) -> float | None:
        """Number of the clock in a line, as far as it has one."""
        if self.clock is None:
            return None
        row = line.split(self.separator, self.clock + 1)
        cell = row[self.clock].strip().strip('"') if len(row) > self.clock else ""
        number = is_number(cell, self.separator != ",")
        return float(with_points(cell)) if number else None

    def _beside(self, row: Sequence[str]) -> Sequence[str]:
        """Cells behind the name; those before it where hardly any are behind."""
        behind = row[self.column + 1 :]
        return behind if len(behind) >= FEWEST_COLUMNS else row[: self.column]

    def only(self, name: str, lines: Sequence[str]) -> list[str]:
        """Lines of one IMU, and those that are none of any."""
        return [line for line in lines if self._cell(line) in (name, None)]

    def _cell(self, line: str) -> str | None:
        row = line.split(self.separator)
        cell = row[self.column].strip().strip('"') if len(row) > self.column else ""
        return cell if cell in (*self.names, *self.silent, *self.few) else None


def find_instances(lines: Sequence[str], separator: str | None) -> ImuInstances | None:
    """Find the column that distinguishes several IMUs; None for a single IMU."""
    if not lines:
        return None
    parted = separator or find_separator(lines[-1])
    numbers, above = _rows_of(lines, parted)
    found: list[tuple[bool, ImuInstances]] = []
    for i in range(len((numbers or above)[-1])):
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
            found.append((named, ImuInstances(i, parted, live, tuple(silent))))
    # two devices may be of one model
    best = max(found, key=lambda one: (one[0], len(one[1].names)), default=None)
    return best[1] if best is not None else None


def named_columns(lines: Sequence[str], separator: str | None) -> list[ImuInstances]:
    """Columns whose names say that they tell IMUs apart, whose rows may lie apart.

    With the names that are among these lines, of which there may be one.
    """
    if not lines:
        return []
    parted = separator or find_separator(lines[-1])
    numbers, above = _rows_of(lines, parted)
    found = []
    for tells in (tells_devices, tells_wearers):
        for i in range(len(numbers[-1]) if numbers else 0):
            said = [row[i] for row in above if tells(row[i])]
            if not said:
                continue
            names = dict.fromkeys(row[i] for row in numbers)
            counted = all(is_number(name, False) for name in names)
            if not (counted and any(map(may_count, said))):
                clock = _growing(numbers, i, parted)
                found.append(ImuInstances(i, parted, tuple(names), clock=clock))
    return found


def _growing(
    rows: Sequence[Sequence[str]], i: int, separator: str | None
) -> int | None:
    """Column that never steps back, in the first rows of one name; None if none is."""
    own = [row for row in rows if row[i] == rows[0][i]]
    table = parse_numbers([(separator or " ").join(row) for row in own], separator)
    for at, column in enumerate(table.T):
        steps = np.diff(column)
        if at != i and len(steps) and (steps >= 0).all() and steps.any():
            return at
    return None


def _rows_of(
    lines: Sequence[str], separator: str | None
) -> tuple[list[list[str]], list[list[str]]]:
    """Rows of numbers, and those of words, that are as wide as the last line."""
    rows = [split_cells(line, separator) for line in lines]
    numbers: list[list[str]] = []
    above: list[list[str]] = []
    for row in rows:
        if len(row) == len(rows[-1]):
            values = (cell for cell in row if is_number(cell, separator != ","))
            several = len([*islice(values, 2)]) > 1
            (numbers if several else above).append(row)
    return numbers, above


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
