"""Series of a text with a line for each value: its name, its time and the value.

    time,variable,value                 as data frames are melted
    0.00,ax,0.1
    …
    0.00,ay,0.2                         the lines of one series behind another's

    ,result,table,_time,_value,_field   as databases of time series are asked
    "Series";"Time";"Value"             as what shows them writes it

Where the lines of a time stand together, whoever reads lines need not know all of them;
here they may stand anywhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Self

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.text.text_top import (
    SEPARATORS,
    is_number,
    split_cells,
    with_points,
)
from fieldcal.importing.times.alignment import nearest_in_time
from fieldcal.importing.times.clock_text import ClockText, is_clock
from fieldcal.importing.words.device_names import may_count, tells_devices
from fieldcal.importing.words.heading_units import parse_unit
from fieldcal.importing.words.heading_words import heading_meaning

VALUES = {"value", "state", "val", "reading", "wert"}
SERIES = {"series", "variable", "field", "name", "channel", "metric", "entityid",
          "nodeid", "tag", "signal", "measurement", "parameter", "key", "topic",
          "quantity", "axis"}  # fmt: skip
"""Names of the columns that hold values, and what they are of."""

UNITS = {"unit", "units"}

TOP = 40
"""Lines at the top among which the names of the columns are."""

MOST = 1000
"""Series of a text."""

FEWEST = 3
"""Lines of values that tell such a text."""


class SeriesColumns(NamedTuple):
    """Which columns of a text hold series.

    Attributes
    ----------
    separator : of columns
    width : columns
    time, value : numbers of columns
    named : columns that together say what a value is
    unit : column of its unit, or None

    """

    separator: str
    width: int
    time: int
    value: int
    named: tuple[int, ...]
    unit: int | None

    @classmethod
    def of(cls, lines: Sequence[str]) -> Self | None:
        """The columns, if a line at the top names them and others hold axes."""
        for at, line in enumerate(lines[:TOP]):
            for separator in SEPARATORS:
                head = split_cells(line, separator)
                found = cls._named(head, separator)
                if found is None:
                    continue
                rows = [split_cells(one, separator) for one in lines[at + 1 :]]
                whole = [row for row in rows if found.says(row)]
                axes = [row for row in whole if _is_axis(found.name(row))]
                if len(axes) >= FEWEST and len(whole) > len(rows) / 2:
                    return found
        return None

    @classmethod
    def _named(cls, head: Sequence[str], separator: str) -> Self | None:
        """The columns, by a line of their names."""
        bare = [re.sub(r"[\W_]+", "", cell.lower()) for cell in head]
        value = [i for i, name in enumerate(bare) if name in VALUES]
        named = [i for i, name in enumerate(bare) if name in SERIES]
        if len(value) != 1 or not named:
            return None
        times = [i for i, cell in enumerate(head) if _is_time(cell)]
        if not times:
            return None
        devices = [
            i
            for i, cell in enumerate(head)
            if tells_devices(cell) and not may_count(cell)
        ]
        unit = next((i for i, name in enumerate(bare) if name in UNITS), None)
        # "_start" and "_stop" are what a database was asked for
        time = min(times, key=lambda i: bare[i] not in ("time", "timestamp"))
        together = tuple(sorted({*devices, *named} - {time, value[0]}))
        return cls(separator, len(head), time, value[0], together, unit)

    def says(self, row: Sequence[str]) -> bool:
        """Whether cells are a time, a name and a value."""
        if len(row) != self.width:
            return False
        time, value = row[self.time], row[self.value]
        told = is_number(time, self.separator != ",") or is_clock(time)
        return told and (not value or is_number(value, self.separator != ","))

    def name(self, row: Sequence[str]) -> str:
        """What a row says that its value is."""
        parts = (re.split("[;=/]", row[i])[-1] for i in self.named)
        name = " ".join(part for part in parts if part)
        unit = row[self.unit] if self.unit is not None else ""
        return f"{name} [{unit}]" if parse_unit(unit) else name


class ValueSeries(NamedTuple):
    """Times (n,) and values (n,), in the order of the text; its clock may be one's."""

    t: Array
    values: Array


def read_series(
    lines: Iterable[str], columns: SeriesColumns
) -> tuple[dict[str, ValueSeries], bool]:
    """Series of a text by their names, and whether their times are those of a clock.

    Raises
    ------
    InputError
        If there are more than any log has.

    """
    found: dict[str, tuple[list[float], list[float]]] = {}
    clocks: dict[str, ClockText] = {}
    clocked = False
    for line in lines:
        row = split_cells(line, columns.separator)
        if not columns.says(row):
            continue
        name = columns.name(row)
        times, values = found.setdefault(name, ([], []))
        if len(found) > MOST:
            raise InputError(
                f"has more than {MOST} series, such as {name}: write a row for each"
                " sample, such as t,ax,ay,az,gx,gy,gz with commas between"
            )
        time = row[columns.time]
        if is_clock(time):
            clocked = True
            since = clocks.setdefault(name, ClockText()).seconds(time)
        else:
            since = float(_with_point(time, columns.separator))
        times.append(np.nan if since is None else since)
        value = row[columns.value]
        values.append(float(_with_point(value, columns.separator)) if value else np.nan)
    return {
        n: ValueSeries(np.array(t), np.array(x)) for n, (t, x) in found.items()
    }, clocked


def arrays_of(series: dict[str, ValueSeries], time: str) -> dict[str, Array]:
    """Values of the axes side by side, each sensor with the times of its first axis.

    Parameters
    ----------
    series : by name
    time : what the times of each are called

    """
    groups: dict[tuple[str, tuple[str, ...]], dict[str, ValueSeries]] = {}
    for name, one in series.items():
        said = heading_meaning(name)
        if said is not None and said.kind in ("a", "g", "temperature"):
            label = tuple(w for w in said.label if w not in ("acc", "gyro"))
            groups.setdefault((said.kind, label), {})[name] = one
    found: dict[str, Array] = {}
    for (kind, label), members in groups.items():
        group = "_".join([*label, {"a": "acc", "g": "gyro"}.get(kind, kind)])
        first = next(iter(members.values()))
        order = np.argsort(first.t, kind="stable")
        t = first.t[order]
        found[f"{group}/{time}"] = t
        step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        for name, one in members.items():
            by_time = np.argsort(one.t, kind="stable")
            near, apart = nearest_in_time(t, one.t[by_time])
            values = one.values[by_time][near]
            found[f"{group}/{name}"] = np.where(apart <= step / 2, values, np.nan)
    return found


def _is_axis(name: str) -> bool:
    """Whether a name is that of an axis of a sensor."""
    said = heading_meaning(name)
    return said is not None and said.kind in ("a", "g") and bool(said.axis)


def _is_time(cell: str) -> bool:
    """Whether a name is that of a time."""
    said = heading_meaning(cell)
    return (said is not None and said.kind == "t") or cell.lower() == "last_changed"


def _with_point(cell: str, separator: str) -> str:
    """A number whose decimal comma is a point."""
    return cell if separator == "," else with_points(cell)
