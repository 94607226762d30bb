"""JSON Schemas of the files, and the error texts for a document that violates one.

The schemas are in ``schemas/``. The description of a key is the remedy in the error
text.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
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


def schema_fault(tables: Mapping[str, Any], checked_by: Any) -> str:
    """Fault of a document, with key and remedy; empty if it is valid.

    Parameters
    ----------
    tables : the parsed document
    checked_by : a `validator`

    """
    from jsonschema.exceptions import best_match

    error = best_match(checked_by.iter_errors(tables))
    if error is None:
        return ""
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
    if path[0] == "position":
        number = int(path[1]) + 1
        return " ".join([f"[[position]] number {number}", *map(str, path[2:])])
    depth = 2 if path[:2] == ["run", "mover"] and len(path) > 2 else 1
    table = ".".join(map(str, path[:depth]))
    return " ".join([f"[{table}]", *map(str, path[depth:])])
