"""Documents that are nearly JSON: cut off, or with a comma behind their last record.

[{"t": 0, "ax": 0.1}, {"t": 0.01, "ax": 0.1}, {"t": 0.0        two records are whole
[{"t": 0, "ax": 0.1}, {"t": 0.01, "ax": 0.1},]
"""

from __future__ import annotations

import re
from collections import Counter

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}]')
_CLOSES = {"[": "]", "{": "}"}

_COMMA = re.compile(r'("(?:[^"\\]|\\.)*")|,(?=\s*[\]}])')

FEWEST = 2
"""Records that tell at what depth they lie."""


def whole_beginning(text: str) -> str | None:
    """A document up to its last whole record, with its brackets closed.

    None of a text that is no such document: one with several of them, or none.

    >>> whole_beginning('{"a": [{"t": 0}, {"t": 1}, {"t":')
    '{"a": [{"t": 0}, {"t": 1}]}'
    >>> whole_beginning('{"t": 0}'), whole_beginning('{"t": 0')
    (None, None)
    """
    open_: list[str] = []
    closed: Counter[int] = Counter()
    last: dict[int, tuple[int, str]] = {}
    for token in _TOKEN.finditer(text):
        sign = token[0]
        if sign in _CLOSES:
            open_.append(sign)
        elif len(sign) == 1:
            if not open_ or _CLOSES[open_.pop()] != sign or not open_:
                return None
            if open_[-1] != "[":
                # of lists side by side, one that is whole is no part of the others
                continue
            closed[len(open_)] += 1
            rest = "".join(_CLOSES[one] for one in reversed(open_))
            last[len(open_)] = token.end(), rest
    deep = [depth for depth, many in closed.items() if many >= FEWEST]
    if not deep or not open_:
        return None
    end, rest = last[min(deep)]
    return text[:end] + rest


def without_last_commas(text: str) -> str:
    """A document without commas behind the last of what lies in brackets.

    >>> without_last_commas('[{"a": ",]",}, ]')
    '[{"a": ",]"} ]'
    """
    return _COMMA.sub(lambda found: found[1] or "", text)
