"""Reading JSON whose keys may be absent or of another kind: then there is nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
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


def real(value: object) -> float:
    """A number, nan where there is none.

    >>> real(3), real(None), real("3")
    (3.0, nan, nan)
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    return float(value)


def shown(value: object, form: str) -> str:
    """A number as a text; a dash where there is none.

    >>> shown(0.5, "{:.2f}"), shown(None, "{:.2f}")
    ('0.50', '–')
    """
    number = real(value)
    return form.format(number) if math.isfinite(number) else "–"
