"""Rows of several devices in one table of arrays, which one of its columns tells apart.

sensor_id  t     acc               each device has the rows with its number alone,
1          0.00  0.1 0.2 9.8       whether they come in turn or one device behind the
2          0.00  0.1 0.3 9.7       other
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Index
from fieldcal.importing.arrays.array_tables import ArrayTable, columns_of
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.text.instances import MAX_NAMED, MIN_ROWS
from fieldcal.importing.times.name_changes import NameChanges
from fieldcal.importing.words.device_names import (
    may_count,
    tells_devices,
    tells_wearers,
)
from fieldcal.importing.words.heading_words import heading_meaning


class DeviceRows(NamedTuple):
    """Rows of each of several devices.

    Attributes
    ----------
    length : rows of the arrays in which they lie
    of : rows (m,) of each, by its number

    """

    length: int
    of: Mapping[str, Index]

    def alone(
        self, device: str, tables: Mapping[str, ArrayTable]
    ) -> dict[str, ArrayTable]:
        """Arrays with the rows of one device, of those that have rows of all."""
        rows = self.of[device]
        return {
            name: _with_rows(table, rows) if table.shape[0] == self.length else table
            for name, table in tables.items()
        }


def device_rows(tables: Mapping[str, ArrayTable]) -> DeviceRows:
    """Rows of each device in the arrays of a file; none where nothing tells several."""
    named = columns_of(tables)
    for tells in (tells_devices, tells_wearers):
        for column in named:
            if tells(column.name) and not may_count(column.name):
                values = _values(tables, column.place)
                found = _rows_by_number(values)
                if found and not _is_one(values, tables, named):
                    return DeviceRows(len(values), found)
    return DeviceRows(0, {})


def _is_one(
    values: Array, tables: Mapping[str, ArrayTable], named: Sequence[Column]
) -> bool:
    """Whether the time beside numbers (n,) goes on wherever these change."""
    for column in named:
        said = heading_meaning(column.name, column.unit)
        if said is not None and said.kind == "t":
            t = _values(tables, column.place)
            if len(t) == len(values):
                changes = NameChanges()
                changes.feed(values, t)
                return changes.go_on
    return False


def _values(tables: Mapping[str, ArrayTable], place: str) -> Array:
    """Numbers (n,) of a column by its place, ``array`` or ``array.2``."""
    name, dot, index = place.rpartition(".")
    at = (name, int(index)) if dot and name in tables else (place, 0)
    table = tables[at[0]]
    (found,) = table.read(slice(0, table.shape[0]), [at[1]])
    return found


def _rows_by_number(values: Array) -> dict[str, Index]:
    """Rows (m,) of each whole number in (n,), if there are several with enough rows."""
    if not np.isfinite(values).all() or (values != np.round(values)).any():
        return {}
    numbers, many = np.unique(values, return_counts=True)
    if len(numbers) > MAX_NAMED:
        return {}
    kept = numbers[many >= MIN_ROWS]
    found = {f"{number:.0f}": np.flatnonzero(values == number) for number in kept}
    return found if len(numbers) > 1 else {}


def _with_rows(table: ArrayTable, rows: Index) -> ArrayTable:
    """An array with some of its rows."""

    def read(some: slice, columns: Sequence[int]) -> list[Array]:
        at = rows[some]
        if not len(at):
            return [np.empty(0) for _ in columns]
        first = int(at[0])
        part = table.read(slice(first, int(at[-1]) + 1), columns)
        return [one[at - first] for one in part]

    return ArrayTable((len(rows), table.shape[1]), read, table.unit)
