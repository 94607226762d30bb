"""Objects as Python prints them.

{'t': 0.01, 'acc': [0.1, 0.2, 9.8]}                  also over several lines
{'t': np.float64(0.01), 'acc': array([0.1, 0.2])}    with numbers of NumPy
{'t': datetime.datetime(2024, 5, 3, 12, 0, 0, 10000)}
{'x': 0.1, 'y': 0.2} {'x': 0.3, 'y': 0.4}            several printed in one line
"""

from __future__ import annotations

import ast
import re
from datetime import datetime
from typing import Any

_NUMPY = re.compile(r"\b(?:np|numpy)\.\w+\(([-+.\deE]+)\)")
"""A number of NumPy, as version 2 prints it."""

_ARRAY = re.compile(r"\b(?:np\.|numpy\.)?array\((\[[^()]*\])(?:,\s*dtype=[\w.]+)?\)")
_DATETIME = re.compile(r"\bdatetime\.datetime\(((?:\d+(?:,\s*)?){3,7})\)")
_NAN = re.compile(r"(?<=[\[(:,\s])[-+]?nan(?=[\])},\s])")

_APART = re.compile(r"(?<=})[\s,;|]+(?={)")
"""What stands between objects in a line."""


def python_value(text: str) -> Any:
    """What an object is that Python printed.

    Parameters
    ----------
    text : of one object

    Raises
    ------
    ValueError
        If it is none, or holds others than numbers, texts and what holds these.

    >>> python_value("{'t': np.float64(0.5), 'a': array([1., nan])}")
    {'t': 0.5, 'a': [1.0, None]}
    >>> python_value("datetime.datetime(2024, 5, 3, 12, 0)")
    '2024-05-03T12:00:00.000000'
    """
    bare = _ARRAY.sub(r"\1", _NUMPY.sub(r"\1", _NAN.sub("None", text)))
    try:
        return ast.literal_eval(_DATETIME.sub(_as_text, bare).strip())
    except (SyntaxError, MemoryError, RecursionError) as error:
        raise ValueError(str(error)) from None


def values_side_by_side(text: str) -> dict[str, Any]:
    """Objects that were printed into one line, by their number.

    Raises
    ------
    ValueError
        If there are not several of them.

    >>> values_side_by_side("{'x': 1} {'x': 2}")
    {'1': {'x': 1}, '2': {'x': 2}}
    """
    parts = _APART.split(text.strip())
    if len(parts) < len("ab"):
        raise ValueError("is one object")
    return {str(i): python_value(part) for i, part in enumerate(parts, 1)}


def _as_text(said: re.Match[str]) -> str:
    """A date and time as a text in ISO 8601."""
    numbers = [int(one) for one in said[1].split(",") if one.strip()]
    try:
        return repr(datetime(*numbers).isoformat(timespec="microseconds"))  # type: ignore[arg-type]  # noqa: DTZ001
    except (ValueError, OverflowError):
        return said[0]
