"""A clock whose hours, minutes and seconds have columns of their own.

Year,Month,Day,Hour,Minute,Second,Millisecond,ax,ay,az
utc_hour,utc_minute,utc_second,ax,ay,az
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Column, Heading
from fieldcal.importing.tables.column_times import (
    is_row_counter,
    keeps_growing,
    split_seconds,
)
from fieldcal.importing.words.heading_words import heading_meaning, words_in_name

HOURS = ("hour", "hours", "hr", "hh", "stunde", "heure", "hora", "时", "時")
MINUTES = ("minute", "minutes", "min", "mm", "minuto", "分")
SECONDS = ("second", "seconds", "sec", "secs", "ss", "sekunde", "seconde", "segundo",
           "秒")  # fmt: skip
BESIDE = ("utc", "gps", "time", "local", "rtc", "clock", "of", "the", "day")
"""Words that stand beside them."""

BELOW, SIZES = (24, 60, 61), (3600, 60, 1)
"""Numbers that hours, minutes and seconds stay below, and s in one of each. Some
minutes have 61 seconds."""

PARTS = ("t_h", "t_min", "time [s]")
"""What the columns are called then."""


class ClockColumns(NamedTuple):
    """Numbers of the columns of hours, minutes and seconds; -1 where there is none."""

    hour: int
    minute: int
    second: int


def with_clock_columns(way: Heading, table: Array) -> Heading:
    """A heading in which such columns are named as parts of the time.

    Where another column is the time, they are left out.

    Parameters
    ----------
    way : what stands above the columns
    table : (n, k) numbers of the first rows; nan where a cell is none

    """
    if table.shape[1] != len(way.columns):
        return way
    found = _find(way.columns)
    if found is None or not _is_clock(table, found):
        return way
    names = [*way.columns]
    split = split_seconds(table, [found.second])
    own = {*found, *([split.fraction] if split is not None else [])}
    others = {i for i in range(len(names)) if _is_time(names[i], table[:, i])}
    apart = bool(others - own)
    for i, part in zip(found, PARTS, strict=True):
        if i >= 0:
            names[i] = names[i]._replace(name="" if apart else part, unit="")
    return Heading(names, way.skip)


def _find(columns: Sequence[Column]) -> ClockColumns | None:
    """Columns of minutes and seconds, and of hours if there are any."""
    words = [words_in_name(column.name) for column in columns]
    one = [_one_of(words, names) for names in (HOURS, MINUTES, SECONDS)]
    found = ClockColumns(*one)
    return found if min(found.minute, found.second) >= 0 else None


def _one_of(words: Sequence[Sequence[str]], names: Sequence[str]) -> int:
    """Number of the only column that is called so; -1 if none or several are."""
    found = [
        i for i, said in enumerate(words)
        if {*said} & {*names} and {*said} <= {*names, *BESIDE}
    ]  # fmt: skip
    return found[0] if len(found) == 1 else -1


def _is_clock(table: Array, at: ClockColumns) -> bool:
    """Whether the numbers are those of a clock, which goes on."""
    total = np.zeros(len(table))
    for i, most, size in zip(at, BELOW, SIZES, strict=True):
        if i < 0:
            continue
        part = table[np.isfinite(table[:, i]), i]
        whole = i == at.second or (part == np.round(part)).all()
        if not (len(part) and whole and 0 <= part.min() <= part.max() < most):
            return False
        total += table[:, i] * size
    return keeps_growing(total)


def _is_time(column: Column, values: Array) -> bool:
    """Whether a column is called a time, and is one."""
    said = heading_meaning(column.name, column.unit)
    named = said is not None and said.kind == "t"
    return named and keeps_growing(values) and not is_row_counter(values)
