"""Which of the columns that are named as times are times, by their numbers."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.tables.column_times import (
    is_row_counter,
    keeps_growing,
    split_seconds,
)
from fieldcal.importing.units.time_units import shared_times
from fieldcal.importing.words.heading_words import heading_meaning


def with_checked_times(way: Heading, table: Array) -> Heading:
    """A heading in which only columns whose numbers are times are named as times.

    Of several columns that are named as times, one may hold a date, count rows, or be
    too coarse. Each may be empty, or be the same in all rows.

    Parameters
    ----------
    way : what stands above the columns
    table : (n, k) numbers of the first rows; nan where a cell is none

    """
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
    for lacks in (is_row_counter, are_shared_times):
        fit = [i for i in fit if not lacks(table[:, i])] or fit
    fit = fit if fit and len(named) > 1 else [i for i in named if i not in empty]
    names = [*way.columns]
    for i in {*named} - {*fit}:
        names[i] = names[i]._replace(name="")
    return Heading(names, way.skip)


def are_shared_times(t: Array) -> bool:
    """Whether times (n,) are shared by several rows."""
    shared = shared_times(t)
    return shared is not None and shared.equal
