"""Parse TOML and JSON text; every text that cannot be parsed raises one kind of error.

The parsers raise RecursionError for deep nesting, and a plain ValueError for a number
with more digits than Python converts. Both become errors of the text. A byte order
mark, with which some editors begin a text, is skipped.
"""

from __future__ import annotations

import json
import tomllib
from typing import Any

BYTE_ORDER_MARK = "\ufeff"
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
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise tomllib.TOMLDecodeError(NESTED_TOO_DEEPLY) from None
    except ValueError:
        raise tomllib.TOMLDecodeError(NUMBER_TOO_LONG) from None


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
