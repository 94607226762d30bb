"""Which of the columns that are named as times are times, by their numbers."""

from __future__ import annotations

import re

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.tables.clock_columns import with_clock_columns
from fieldcal.importing.tables.column_times import (
    grows_each_row,
    is_row_counter,
    keeps_growing,
    split_seconds,
)
from fieldcal.importing.units.shared_times import (
    shared_times,
)
from fieldcal.importing.words.heading_words import heading_meaning

CELSIUS = "deg C"

_LETTER = re.compile(r"[tT]\d?")
"""What is a time or a thermometer."""

DEVICES = -40.0, 125.0
"""Temperatures at which devices work, deg C."""


def with_checked_times(way: Heading, table: Array) -> Heading:
    """A heading in which only columns whose numbers are times are named as times.

    Of several columns that are named as times, one may hold a date, count rows, or be
    too coarse. Each may be empty, or be the same in all rows.

    Parameters
    ----------
    way : what stands above the columns
    table : (n, k) numbers of the first rows; nan where a cell is none

    """
    way = with_clock_columns(way, table)
    way = _without_sums(_with_thermometer(way, table), table)
    said = [heading_meaning(column.name, column.unit) for column in way.columns]
    named = [i for i, one in enumerate(said) if one is not None and one.kind == "t"]
    if not named or table.shape[1] != len(way.columns) or not len(table):
        return way
    # a spreadsheet that shortens times to 1.7E+12 leaves one for all rows
    empty = [i for i in named if len({*table[np.isfinite(table[:, i]), i]}) < 2]
    fit = [i for i in named if keeps_growing(table[:, i])]
    # what is beyond the whole seconds of another column is no time by itself
    split = split_seconds(table, range(table.shape[1]))
    fit = [i for i in fit if split is None or i != split.fraction]
    # the seconds of a clock in two columns are shared, and whole with the other
    whole = {split.whole} if split is not None else set()
    for lacks in (is_row_counter, are_shared_times):
        fit = [i for i in fit if i in whole or not lacks(table[:, i])] or fit
    fit = fit if fit and len(named) > 1 else [i for i in named if i not in empty]
    names = [*way.columns]
    for i in {*named} - {*fit}:
        names[i] = names[i]._replace(name="")
    return Heading(names, way.skip)


def _without_sums(way: Heading, table: Array) -> Heading:
    """A heading in which steps of the time that grow from row to row are the time.

    ``Interval`` is the time since the row before, or since the beginning.
    """
    said = [heading_meaning(column.name, column.unit) for column in way.columns]
    kinds = [one.kind if one is not None else "" for one in said]
    if table.shape[1] != len(kinds) or "t" in kinds:
        return way
    names = [*way.columns]
    for i, one in enumerate(said):
        if one is not None and one.kind == "dt" and grows_each_row(table[:, i]):
            counts = one.unit is None and is_row_counter(table[:, i])
            name = "" if counts else "time"
            names[i] = names[i]._replace(name=name, unit=one.unit or "")
    return Heading(names, way.skip)


def _with_thermometer(way: Heading, table: Array) -> Heading:
    """A heading in which a ``T`` behind the axes is what its numbers are: deg C.

    Who writes the time writes it first, and it grows from row to row. Of several, T1
    and T2, nobody knows which is near the IMU: they are left out.
    """
    said = [heading_meaning(column.name, column.unit) for column in way.columns]
    kinds = [one.kind if one is not None else "" for one in said]
    if table.shape[1] != len(kinds):
        return way
    names = [*way.columns]
    letters = [
        i for i, column in enumerate(names)
        if _LETTER.fullmatch(column.name.strip()) and not column.unit
        and {"a", "g"} & {*kinds[:i]}
    ]  # fmt: skip
    warm = [i for i in letters if _is_warmth(table[:, i])]
    if len(letters) == 1 and not warm and not keeps_growing(table[:, letters[0]]):
        # what goes up and down is no time: a thermometer in counts
        names[letters[0]] = names[letters[0]]._replace(name="temperature")
        return Heading(names, way.skip)
    alone = len(warm) == 1 and "temperature" not in kinds
    for i in warm:
        own = {"unit": CELSIUS} if alone else {"name": ""}
        names[i] = names[i]._replace(**own)
    return Heading(names, way.skip) if warm else way


def _is_warmth(column: Array) -> bool:
    """Whether numbers (n,) may be deg C, and are no times of their own rows."""
    known = column[np.isfinite(column)]
    within = len(known) and DEVICES[0] <= known.min() and known.max() <= DEVICES[1]
    return bool(within and (not keeps_growing(column) or are_shared_times(column)))


def are_shared_times(t: Array) -> bool:
    """Whether times (n,) are shared by several rows."""
    shared = shared_times(t)
    return shared is not None and shared.equal
