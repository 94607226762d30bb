"""marks.jsonl: events of a run, one in each line.

Every line has the checksum of its own text. A line that was cut off or changed is left
out and reported; the other lines are used.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from fieldcal.core.documents import json_values, load_json
from fieldcal.core.errors import SessionError

MARKS = "marks.jsonl"

POSITION_ADDED = "added"
"""Mark of a position that was added to the planned ones, with its angles, and with the
length of its window where that is its own."""


def mark_line(mark: Mapping[str, Any]) -> str:
    r"""Return a mark as a line of marks.jsonl, with its checksum.

    >>> mark_line({"event": "told"})
    '{"event": "told", "crc32": "1a049d94"}\n'

    nan and infinity become null, so that each line is JSON.
    """
    text = json.dumps(json_values(mark), allow_nan=False)
    return f'{text[:-1]}, "crc32": "{zlib.crc32(text.encode()):08x}"}}\n'


def taken_windows(marks: Iterable[Mapping[str, Any]]) -> dict[int, tuple[float, float]]:
    """Window of each position that has one which was not discarded, s of device time.

    >>> window = {"event": "window", "position": 0, "start_s": 1, "end_s": 9}
    >>> taken_windows([window])
    {0: (1.0, 9.0)}
    >>> taken_windows([window, {"event": "repeated", "position": 0}])
    {}
    """
    taken: dict[int, tuple[float, float]] = {}
    for mark in marks:
        number = mark.get("position")
        if not isinstance(number, int):
            continue
        if mark.get("event") == "window":
            taken[number] = float(mark["start_s"]), float(mark["end_s"])
        elif mark.get("event") == "repeated":
            taken.pop(number, None)
    return taken


def gaps_without_restart(
    marks: Iterable[Mapping[str, Any]],
) -> Iterator[tuple[float, float]]:
    """Last time before and first after gaps in which the device did not restart, s.

    >>> gap = {"event": "link", "from_s": 3.0, "to_s": 5.5}
    >>> list(gaps_without_restart([gap, gap | {"restarted": False}]))
    [(3.0, 5.5)]
    """
    for mark in marks:
        if mark.get("event") == "link" and mark.get("restarted") is False:
            yield float(mark["from_s"]), float(mark["to_s"])


def insisted_positions(marks: Iterable[Mapping[str, Any]]) -> dict[int, str]:
    """Positions that the operator accepted though they looked wrong, and what did."""
    insisted: dict[int, str] = {}
    for mark in marks:
        number = mark.get("position")
        if not isinstance(number, int):
            continue
        if mark.get("event") == "asked":
            insisted.pop(number, None)
        elif mark.get("event") == "insisted":
            insisted[number] = str(mark.get("text", ""))
    return insisted


def read_marks(path: Path, says: list[str] | None = None) -> Iterator[dict[str, Any]]:
    """Marks with a correct checksum; none if there is no file.

    Lines that were changed or cut off are left out.

    Parameters
    ----------
    path : marks.jsonl
    says : list to which a sentence is added for each line that was left out

    Raises
    ------
    SessionError
        If the file cannot be read.

    """
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    except FileNotFoundError:
        return
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error}") from error
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        mark = _mark(line)
        if mark is not None:
            yield mark
        elif says is not None:
            what = "was cut off" if number == len(lines) else "is damaged"
            says.append(f"{path.name}: line {number} {what} and left out")


def _mark(line: str) -> dict[str, Any] | None:
    """Return the mark in a line; None if it is not one, or was changed."""
    try:
        mark = load_json(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(mark, dict):
        return None
    told = mark.pop("crc32", None)
    text = line.rpartition(', "crc32": ')[0] + "}"
    if told is not None and told != f"{zlib.crc32(text.encode()):08x}":
        return None
    return mark
