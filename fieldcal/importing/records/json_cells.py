r"""Rows of a table of which a cell holds a record in JSON, as databases export them.

    created_at,topic,payload
    2024-05-03T14:20:31.123Z,lab/imu,"{""ax"": 0.1, ""ay"": 0.2, ""az"": 9.8}"

A row is its record, with the other cells beside it by the names above them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from fieldcal.importing.records.python_text import python_value
from fieldcal.importing.text.text_lines import split_quoted
from fieldcal.importing.text.text_top import is_number

SEPARATORS = (",", ";", "\t")


def record_in_cells(line: str, names: Sequence[str] = ()) -> dict[str, Any] | None:
    r"""The record in a cell of a line, with its other cells; None of another line.

    Parameters
    ----------
    line : with quotes about the cell
    names : of the cells, where a line above says them

    >>> record_in_cells('7,1.5,"{""ax"": 0.1}"', ["id", "time", "data"])
    {'id': 7.0, 'time': 1.5, 'ax': 0.1}
    >>> record_in_cells('{"ax": 0.1}'), record_in_cells('"ax","ay"')
    (None, None)
    """
    if '"{' not in line or line.lstrip().startswith("{"):
        return None
    for separator in SEPARATORS:
        cells = split_quoted(line.strip(), separator)
        inner = [(i, one) for i, cell in enumerate(cells) if (one := _record(cell))]
        if len(cells) > 1 and len(inner) == 1:
            ((place, record),) = inner
            known = names if len(names) == len(cells) else [""] * len(cells)
            beside = {
                name or f"cell {i + 1}": float(cell) if is_number(cell, False) else cell
                for i, (name, cell) in enumerate(zip(known, cells, strict=True))
                if i != place
            }
            return beside | record
    return None


def cell_names(line: str) -> list[str]:
    """Cells of a line that may hold names.

    >>> cell_names("created_at;payload")
    ['created_at', 'payload']
    """
    rows = (split_quoted(line.strip(), separator) for separator in SEPARATORS)
    return [cell.strip() for cell in max(rows, key=len)]


def _record(cell: str) -> dict[str, Any] | None:
    """The record that a cell holds; None of another cell."""
    if not cell.strip().startswith("{"):
        return None
    for read in (json.loads, python_value):
        try:
            value = read(cell)
        except (ValueError, RecursionError):
            continue
        return value if isinstance(value, dict) else None
    return None
