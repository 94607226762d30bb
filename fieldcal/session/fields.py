"""Values of a session.toml, checked: what is wrong is refused by its key.

All raise an `InputError` that names table and key.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError


def table(raw: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return a table, an empty one where it is not there."""
    found = raw.get(name, {})
    if not isinstance(found, Mapping):
        raise InputError(f"{name} must be a table: write [{name}]")
    return found


def number(there: Mapping[str, Any], name: str, key: str, default: float) -> float:
    """Return a finite number of a table, or the default."""
    value = there.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"[{name}] {key} = {value!r} is not a number")
    if not np.isfinite(value):
        raise InputError(f"[{name}] {key} = {value} is not a finite number")
    return float(value)


def positive(there: Mapping[str, Any], name: str, key: str) -> float | None:
    """Return a number above 0; None where it is not there."""
    if key not in there:
        return None
    value = number(there, name, key, 0.0)
    if value <= 0:
        raise InputError(f"[{name}] {key} = {value:g} must be above 0; mend it")
    return value


def choice(
    raw: Mapping[str, Any], name: str, key: str, known: Any, default: str
) -> str:
    """Return one of the words that are known."""
    value = table(raw, name).get(key, default)
    if value not in known:
        raise InputError(f"[{name}] {key} = {value!r} is none of: {', '.join(known)}")
    return str(value)
