"""JSON Schemas of the files, and the error texts for a document that violates one.

The schemas are in ``schemas/``. The description of a key is the remedy in the error
text.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from operator import ne
from typing import Any


def load_schema(kind: str) -> dict[str, Any]:
    """Return a schema: session, plan, mark, result, diagnosis, noise or export."""
    path = files("fieldcal").joinpath(f"schemas/{kind}.schema.json")
    found: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return found


@cache
def validator(kind: str) -> Any:
    """Validator for one of the schemas, by its name."""
    return make_validator(load_schema(kind))


def make_validator(content: Mapping[str, Any]) -> Any:
    """Validator for a schema; nan and infinity are no numbers."""
    from jsonschema import Draft202012Validator
    from jsonschema.validators import extend

    types = Draft202012Validator.TYPE_CHECKER.redefine("number", _is_number)
    return extend(Draft202012Validator, type_checker=types)(content)


def _is_number(_: Any, value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


MOST_TOLD = 9
"""Most faults of a document that are told at once."""

NEARLY = 0.7
"""Similarity from which a key is taken for a misspelt one."""


def schema_fault(tables: Mapping[str, Any], checked_by: Any) -> str:
    """Faults of a document, each with key and remedy; empty if it is valid.

    Parameters
    ----------
    tables : the parsed document
    checked_by : a `validator`

    """
    return told_together(schema_faults(tables, checked_by))


def schema_faults(tables: Mapping[str, Any], checked_by: Any) -> list[str]:
    """A sentence for each fault of a document, the most general first.

    Parameters are those of `schema_fault`.
    """
    from jsonschema.exceptions import best_match, relevance

    errors = sorted(checked_by.iter_errors(tables), key=relevance, reverse=True)
    # of what fits none of several forms, the form that comes nearest
    return list(dict.fromkeys(_sentence(best_match([error])) for error in errors))


def told_together(faults: Sequence[str]) -> str:
    """All faults in one: who mends a file mends them together.

    >>> told_together(["a: b", "c: d"])
    'a: b; and c: d'
    """
    told = list(faults[:MOST_TOLD])
    if more := len(faults) - len(told):
        told.append(f"{more} more")
    return "; and ".join(told)


def misspelt_keys(tables: Mapping[str, Any], *schemas: Mapping[str, Any]) -> list[str]:
    """A sentence for each unknown key that is nearly a known one.

    Unknown keys are the user's own, and are kept. One that is nearly known is a fault
    that would go unnoticed: what it states would not be used.
    """
    known: dict[str, Any] = {}
    for schema in schemas:
        known |= schema.get("properties", {})
    found = [*_misspelt(tables, known, []), *_misplaced(tables, known)]
    for name, inner in tables.items():
        form = known.get(name, {})
        many = isinstance(inner, list)
        names = form.get("items", form).get("properties", {})
        for number, table in enumerate(inner if many else [inner]):
            if names and isinstance(table, Mapping):
                found += _misspelt(table, names, [name, number] if many else [name])
    return found


def _misspelt(
    table: Mapping[str, Any], known: Mapping[str, Any], path: list[str | int]
) -> list[str]:
    found = []
    for key in table:
        near = [name for name in known if name.startswith(f"{key}_")]  # lacks its unit
        near += get_close_matches(key, known, 1, NEARLY)
        near += [name for name in known if _is_one_letter_off(key, name)]
        if near and key not in known:
            found.append(f"{_key([*path, key])} is not known: write {near[0]}")
    return found


def _is_one_letter_off(key: str, name: str) -> bool:
    """Whether one letter is another, which of a short name is a large part."""
    return len(key) == len(name) and sum(map(ne, key, name)) == 1


def _misplaced(tables: Mapping[str, Any], known: Mapping[str, Any]) -> list[str]:
    """Sentences about keys above all tables that belong into one of them."""
    inside = {
        name: form.get("items", form).get("properties", {})
        for name, form in known.items()
    }
    found = []
    for key in (k for k, v in tables.items() if not isinstance(v, Mapping | list)):
        homes = [
            (table, name)
            for table, names in inside.items()
            for name in names
            if name == key or name.startswith(f"{key}_")
        ]
        if key not in known and len(homes) == 1:
            table, name = homes[0]
            found.append(f"{key} belongs into a table: write {name} below [{table}]")
    return found


def _sentence(error: Any) -> str:
    """Fault that a validator found, with key and remedy."""
    path, needed = list(error.absolute_path), error.validator_value
    remedy = str(error.schema.get("description", "mend it"))
    match error.validator:
        case "required":
            path.append(next(k for k in needed if k not in error.instance))
            what = "is missing"
        case "dependentRequired":
            path.append(_missing(needed, error.instance))
            what = "is missing"
        case "additionalProperties":
            known = error.schema.get("properties", {})
            path.append(next(k for k in error.instance if k not in known))
            what, remedy = "is not known", f"there are {', '.join(known)}"
        case "not":
            what = "does not belong there"
        case _:
            what = f"= {json.dumps(error.instance, ensure_ascii=False, default=str)}"
            what = (what if len(what) < 60 else what[:57] + "…") + " cannot be"
    return f"{_key(path)} {what}: {remedy}"


def _missing(needed: Mapping[str, list[str]], table: Mapping[str, Any]) -> str:
    """The first missing key that another key of the table requires."""
    return next(
        key
        for given, keys in needed.items()
        if given in table
        for key in keys
        if key not in table
    )


def _key(path: list[str | int]) -> str:
    """Key as a reader finds it in the file."""
    if len(path) < 2:
        return ".".join(map(str, path)) or "the file"
    if path[0] == "position" and isinstance(path[1], int):
        number = path[1] + 1
        return " ".join([f"[[position]] number {number}", *map(str, path[2:])])
    depth = 2 if path[:2] == ["run", "mover"] and len(path) > 2 else 1
    table = ".".join(map(str, path[:depth]))
    return " ".join([f"[{table}]", *map(str, path[depth:])])
