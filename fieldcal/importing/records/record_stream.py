r"""Records in JSON one behind the other, with nothing, a comma or a line between.

{"t": 0.01}{"t": 0.02}             as a socket gives them
{"t": 0.01},                       as a list that nobody began or ended
{"t": 0.02},
{\n  "t": 0.01\n}\n{\n            over several lines, as jq shows them
"""

from __future__ import annotations

import json
import re
from typing import Any, NamedTuple

from fieldcal.importing.records.cut_json import FEWEST

_BETWEEN = re.compile(r"[\s,\x1e]*")
"""What stands between two records; the last begins those of RFC 7464."""


class RecordStream(NamedTuple):
    """Records one behind the other.

    Attributes
    ----------
    records : in their order
    is_cut : whether the last one is cut off, and left out

    """

    records: list[Any]
    is_cut: bool = False


def records_in_turn(text: str) -> RecordStream | None:
    r"""Records of a text that holds nothing else; None of another text.

    Of one with a record in each line, whoever reads lines says which is damaged.

    >>> records_in_turn('{"t": 1}{"t": 2}, {"t": 3},').records
    [{'t': 1}, {'t': 2}, {'t': 3}]
    >>> records_in_turn('{"t": 1} {"t": 2} {"t":').is_cut
    True
    >>> records_in_turn('{"t": 1}\n{"t": 2}\n{"t":')
    """
    decode = json.JSONDecoder().raw_decode
    found: list[Any] = []
    at, longest = _end(text, 0), 0
    while at < len(text):
        try:
            record, end = decode(text, at)
        except (ValueError, RecursionError):
            lines = text.count("\n", 0, at)
            whole = len(found) < FEWEST or len(found) == lines
            is_cut = not whole and len(text) - at <= longest
            return RecordStream(found, True) if is_cut else None
        if not isinstance(record, (dict, list)):
            return None  # rows of numbers, not of JSON
        found.append(record)
        longest, at = max(longest, end - at), _end(text, end)
    return RecordStream(found) if found else None


def _end(text: str, at: int) -> int:
    """Where what stands between two records ends."""
    between = _BETWEEN.match(text, at)
    return between.end() if between else at
