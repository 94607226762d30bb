"""JSON as `pandas.DataFrame.to_json` writes it, in each of its orients.

    {"ax": {"0": 0.1, "1": 0.2}, "ay": {...}}                  columns, the default
    {"0": {"ax": 0.1, "ay": 0.2}, "1": {...}}                  index
    {"columns": ["ax", "ay"], "index": [0, 1], "data": [[0.1, 0.2], ...]}      split
    {"schema": {...}, "data": [{"index": 0, "ax": 0.1}, ...]}                  table
    [["ax", "ay"], [0.1, 0.2], ...]            rows below their names, as others write

Each becomes a list of records. An index that does more than count rows is their time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fieldcal.importing.times.clock_text import is_clock

TIME = "index_time"
"""Name of an index that does more than count rows; a column of times goes before it."""

COUNTS_BELOW = 10**9
"""Whole numbers below which an index counts rows, of which some may have been taken
out: times that pandas writes count from 1970, in ms."""

MIN_ROWS = 2
"""Rows that show an index: of one, any record within a record would be a table."""

Record = dict[str, Any]


def records_of_frame(document: Any) -> list[Record] | None:
    """Records of a data frame; None if the document is none.

    >>> records_of_frame({"ax": {"0": 1.5, "1": 2.5}, "ay": {"0": 3, "1": 4}})
    [{'ax': 1.5, 'ay': 3}, {'ax': 2.5, 'ay': 4}]
    """
    if isinstance(document, list):
        return _of_named_rows(document)
    if not isinstance(document, Mapping):
        return None
    if {"columns", "index", "data"} == {*document}:
        return _of_split(document)
    if {"schema", "data"} == {*document} and isinstance(document["data"], list):
        return [dict(one) for one in document["data"] if isinstance(one, Mapping)]
    inner = list(document.values())
    if not inner or not all(_is_plain(one) for one in inner):
        return None
    if len(document) >= MIN_ROWS and _is_index([*document]):
        return _with_index([*document], [dict(one) for one in inner])
    index = [*inner[0]]
    if len(index) < MIN_ROWS or not _is_index(index):
        return None
    if any([*one] != index for one in inner):
        return None
    rows = [{name: one[key] for name, one in document.items()} for key in index]
    return _with_index(index, rows)


def _of_split(document: Mapping[str, Any]) -> list[Record] | None:
    """Records of names, an index and rows side by side."""
    names, index, rows = (document[key] for key in ("columns", "index", "data"))
    if not all(isinstance(one, list) for one in (names, index, rows)):
        return None
    if len(index) != len(rows) or not all(isinstance(row, list) for row in rows):
        return None
    if any(len(row) != len(names) for row in rows):
        return None
    records = [dict(zip(map(str, names), row, strict=True)) for row in rows]
    return _with_index([str(one) for one in index], records)


def _of_named_rows(rows: list[Any]) -> list[Record] | None:
    """Records of lists of which the first holds the names of the others' values.

    >>> _of_named_rows([["t", "ax"], [0.1, 9.8], [0.2, 9.7]])[1]
    {'t': 0.2, 'ax': 9.7}
    """
    if len(rows) <= MIN_ROWS or not all(isinstance(row, list) for row in rows):
        return None
    names, *others = rows
    named = bool(names) and all(isinstance(name, str) for name in names)
    if not named or any(len(row) != len(names) for row in others):
        return None
    return [dict(zip(names, row, strict=True)) for row in others]


def _with_index(index: Sequence[str], rows: list[Record]) -> list[Record]:
    """Records with their index, if it does more than count them."""
    if not _is_index(index) or _only_counts(index):
        return rows
    return [{TIME: key, **row} for key, row in zip(index, rows, strict=True)]


def _is_index(keys: Sequence[str]) -> bool:
    """Whether keys number rows, or are their times."""
    return all(_is_number(key) or is_clock(key) for key in keys)


def _only_counts(keys: Sequence[str]) -> bool:
    """Whether keys are numbers of rows."""
    return all(key.isdecimal() and int(key) < COUNTS_BELOW for key in keys)


def _is_plain(value: Any) -> bool:
    """Whether a value is a record without records or lists within it."""
    return isinstance(value, Mapping) and not any(
        isinstance(one, (Mapping, list)) for one in value.values()
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
