"""TOML and JSON that others have written: what cannot be read is one kind of error.

A parser follows nesting until the stack ends, and numbers until they have more digits
than Python turns into one. Both are what is wrong with the text, not with us.
"""

from __future__ import annotations

import json
import tomllib
from typing import Any

DEEP = "it is nested too deeply"
LONG = "it has a number of thousands of digits"


def load_toml(text: str) -> dict[str, Any]:
    """Tables of a TOML text.

    Raises
    ------
    tomllib.TOMLDecodeError
        If it is none.

    >>> load_toml("a = " + "[" * 9999)
    Traceback (most recent call last):
      ...
    tomllib.TOMLDecodeError: it is nested too deeply
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise tomllib.TOMLDecodeError(DEEP) from None
    except ValueError:
        raise tomllib.TOMLDecodeError(LONG) from None


def load_json(text: str) -> Any:
    """Content of a JSON text.

    Raises
    ------
    ValueError
        If it is none.

    """
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        raise
    except RecursionError:
        raise ValueError(DEEP) from None
    except ValueError:
        raise ValueError(LONG) from None
