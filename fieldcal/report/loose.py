"""Reading JSON whose keys may be absent or of another kind: then there is nothing."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

Json = Mapping[str, Any]


def table_at(document: Json, key: str) -> Json:
    """The object under a key; empty where there is none."""
    value = document.get(key)
    return value if isinstance(value, Mapping) else {}


def list_at(document: Json, key: str) -> list[Any]:
    """The list under a key; empty where there is none."""
    value = document.get(key)
    return value if isinstance(value, list) else []


def objects_at(document: Json, key: str) -> list[Json]:
    """The objects of the list under a key."""
    return [item for item in list_at(document, key) if isinstance(item, Mapping)]


def group_alike(rows: Sequence[Json], but: str) -> list[tuple[list[str], Json]]:
    """Objects that differ in one key only, together: all its values, and the first.

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


def real(value: object) -> float:
    """A number, nan where there is none.

    >>> real(3), real(None), real("3")
    (3.0, nan, nan)
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    return float(value)


def format_number(value: object, form: str) -> str:
    """A number as a text; a dash where there is none.

    >>> format_number(0.5, "{:.2f}"), format_number(None, "{:.2f}")
    ('0.50', '–')
    """
    number = real(value)
    return form.format(number) if math.isfinite(number) else "–"
