"""Reading of JSON whose keys may be absent or of another type: the result is empty."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

Json = Mapping[str, Any]


def table_at(document: Json, key: str) -> Json:
    """The object of a key; empty if absent."""
    value = document.get(key)
    return value if isinstance(value, Mapping) else {}


def list_at(document: Json, key: str) -> list[Any]:
    """The list of a key; empty if absent."""
    value = document.get(key)
    return value if isinstance(value, list) else []


def objects_at(document: Json, key: str) -> list[Json]:
    """The objects in the list of a key."""
    return [item for item in list_at(document, key) if isinstance(item, Mapping)]


def group_alike(rows: Sequence[Json], but: str) -> list[tuple[list[str], Json]]:
    """Group objects that differ in one key only: all its values, and the first object.

    >>> rows = [{"at": 1, "of": "x"}, {"at": 1, "of": "y"}, {"at": 2, "of": "x"}]
    >>> group_alike(rows, "of")
    [(['x', 'y'], {'at': 1, 'of': 'x'}), (['x'], {'at': 2, 'of': 'x'})]
    """
    found: dict[str, tuple[list[str], Json]] = {}
    for row in rows:
        rest = json.dumps({k: v for k, v in row.items() if k != but}, sort_keys=True)
        values, _ = found.setdefault(rest, ([], row))
        values.append(str(row.get(but, "")))
    return list(found.values())


def number_or_nan(value: object) -> float:
    """A value as a number; nan if it is none.

    >>> number_or_nan(3), number_or_nan(None), number_or_nan("3")
    (3.0, nan, nan)
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    return float(value)


def format_number(value: object, form: str) -> str:
    """A number as text; a dash if there is none.

    >>> format_number(0.5, "{:.2f}"), format_number(None, "{:.2f}")
    ('0.50', '–')
    """
    number = number_or_nan(value)
    return form.format(number) if math.isfinite(number) else "–"
