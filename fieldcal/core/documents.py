"""Parse TOML and JSON text, and make values that JSON can represent.

Every text that cannot be parsed raises one kind of error.

The parsers raise RecursionError for deep nesting, and a plain ValueError for a number
with more digits than Python converts. Both become errors of the text. A byte order
mark, with which some editors begin a text, is skipped.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from datetime import date, time
from typing import Any

BYTE_ORDER_MARK = "\ufeff"
LONGEST_LINE = 60
"""Characters of a faulty line that are told."""

NESTED_TOO_DEEPLY = "it is nested too deeply"
NUMBER_TOO_LONG = "it has a number of thousands of digits"


def load_toml(text: str) -> dict[str, Any]:
    """Tables of a TOML text.

    Raises
    ------
    tomllib.TOMLDecodeError
        If the text is not TOML.

    >>> load_toml(BYTE_ORDER_MARK + "a = 1")
    {'a': 1}
    >>> load_toml("a = " + "[" * 9999)
    Traceback (most recent call last):
      ...
    tomllib.TOMLDecodeError: it is nested too deeply
    """
    try:
        return tomllib.loads(text.removeprefix(BYTE_ORDER_MARK))
    except tomllib.TOMLDecodeError as error:
        raise tomllib.TOMLDecodeError(f"{error}{_line_of(text, str(error))}") from None
    except RecursionError:
        raise tomllib.TOMLDecodeError(NESTED_TOO_DEEPLY) from None
    except ValueError:
        raise tomllib.TOMLDecodeError(NUMBER_TOO_LONG) from None


def _line_of(text: str, error: str) -> str:
    """The line that a parser's error names, and what is usually wrong with it."""
    place = re.search(r"at line (\d+), column (\d+)", error)
    if place is None:
        return ""
    row, column = int(place[1]) - 1, int(place[2]) - 1
    # the parser splits at line feeds only
    line = text.removeprefix(BYTE_ORDER_MARK).split("\n")[row].strip("\r")
    comma = re.fullmatch(r"[^\"'\[{]*=\s*[-+]?\d+", line[:column]) and (
        line[column : column + 1] == ","
    )
    remedy = ": write a decimal point" if comma else ""
    return f", in {line.strip()[:LONGEST_LINE]!r}{remedy}"


def load_json(text: str) -> Any:
    """Content of a JSON text.

    Raises
    ------
    ValueError
        If the text is not JSON.

    >>> load_json(BYTE_ORDER_MARK + "[1]")
    [1]
    """
    try:
        return json.loads(text.removeprefix(BYTE_ORDER_MARK))
    except json.JSONDecodeError:
        raise
    except RecursionError:
        raise ValueError(NESTED_TOO_DEEPLY) from None
    except ValueError:
        raise ValueError(NUMBER_TOO_LONG) from None


def json_values(value: Any) -> Any:
    """Value that JSON can represent: dates become text, nan and infinity null.

    >>> json_values({"bought": date(2026, 1, 2), "range": [2.0, math.inf]})
    {'bought': '2026-01-02', 'range': [2.0, None]}
    """
    if isinstance(value, Mapping):
        return {key: json_values(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_values(each) for each in value]
    if isinstance(value, date | time):  # a datetime is a date
        return value.isoformat()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
