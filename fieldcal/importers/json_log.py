"""JSON: a record a line, a list of records, or lists side by side.

    {"t": 0.01, "acc": [0.1, 0.2, 9.8], "gyro": {"x": 0, "y": 0, "z": 0}}
    [{"time": "2024-05-03T12:00:00.01Z", "ax": 0.1, ...}, ...]
    {"t": [0.01, ...], "ax": [0.1, ...], ...}
    {'t': 0.01, 'ax': 0.1}             [0.01, 0.1, 0.2, 9.8]      as Python prints them,
        also over several lines, with numbers of NumPy, or two objects in a line
    2024-05-03 14:20:31.12,imu,"{""ax"": 0.1, ...}"      a record in a cell of a table
    {"data": [{"imu6": {"Timestamp": 10, "ArrayAcc": [{"x": ...}, ...]}}, ...]}

What lies within is named with what it lies in, ``acc/x``. Records that hold the samples
of some time say when it began; the samples lie evenly until the next begins.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fieldcal.importers.arrays import ArrayFile
from fieldcal.importing.arrays.array_groups import arrays_in_group
from fieldcal.importing.arrays.array_tables import ArrayTable, table_of
from fieldcal.importing.files.text_encoding import as_utf8
from fieldcal.importing.records.cut_json import (
    whole_beginning,
    without_last_commas,
)
from fieldcal.importing.records.json_cells import cell_names, record_in_cells
from fieldcal.importing.records.json_lists import json_lists
from fieldcal.importing.records.python_text import (
    python_value,
    values_side_by_side,
)
from fieldcal.importing.records.record_stream import records_in_turn
from fieldcal.importing.text.text_form import MOSTLY
from fieldcal.importing.times.clock_text import is_clock
from fieldcal.importing.times.said_rate import named_scalars

WHAT = "JSON: records or lists"

BEGINS = re.compile(
    rb"\s*(?:\xef\xbb\xbf)?\s*(?:\{\s*[\"']|\[\s*(?:[\[{]|[-+.\d]+\s*,))"
)


CUT_OFF = "is cut off behind its last whole record"

CLOCK = "time"
"""Name of a time that stands before a record."""

RECORD = re.compile(rb"\s*\{\s*[\"'].*\}\s*")
"""A line that is a record."""

BEFORE = re.compile(r"((?:\[[^{\[\]]*\]|[^{\[])*?)\s*(?:->|:)?\s*(\{.*)")
"""What stands before a record in its line, and the record."""

PART = re.compile(r"\[([^\[\]]*)\]|([^\[\]\s]+)")
"""A part of what stands before: in brackets, or a word."""

NUMBER = re.compile(r"\d+(?:\.\d+)?")


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like JSON, or has records in most of its lines."""
    if BEGINS.match(head) is not None:
        return True
    lines = [line for line in head.split(b"\n")[:-1] if line.strip()]
    return sum(map(_is_record, lines)) > MOSTLY * len(lines)


def _is_record(line: bytes) -> bool:
    """Whether a line is a record, also behind a time or a topic."""
    if RECORD.fullmatch(line) is not None:
        return True
    if record_in_cells(line.decode(errors="replace")) is not None:
        return True
    if BEFORE.fullmatch(line.decode(errors="replace").strip()) is None:
        return False
    try:
        return isinstance(_parse_line(line.decode()), dict)
    except (ValueError, RecursionError):
        return False


class JsonLog(ArrayFile):
    """Numbers in JSON, with one IMU in them or several."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes: nothing."""
        return (), ""

    @contextmanager
    def _whole_arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Every list of numbers in the file."""
        if self._loaded is None:
            text = b"".join(as_utf8(self.pieces())).decode(errors="replace")
            document = self._document(text)
            self._scalars = dict(named_scalars(document))
            with self.named_errors():
                lists = json_lists(document, says=self.says)
                self._loaded = {name: table_of(values) for name, values in lists}
        yield arrays_in_group(self.group, self._loaded)

    def _document(self, text: str) -> Any:
        """What the text holds; lines of records as a list.

        Raises
        ------
        InputError
            If it is not whole.

        """
        for one in (str, without_last_commas):
            try:
                return json.loads(one(text))
            except (ValueError, RecursionError):
                pass
        if (stream := records_in_turn(text)) is not None:
            if stream.is_cut:
                self.damaged("its end", CUT_OFF)
            return stream.records
        if text.strip()[-1:] in ("]", "}") and text.strip().count("\n"):
            try:
                return python_value(text)
            except ValueError:
                pass
        if (whole := whole_beginning(text)) is not None:
            try:
                document = _parse_text(whole)
            except (ValueError, RecursionError):
                document = None
            if document is not None:
                self.damaged("its end", CUT_OFF)
                return document
        found = []
        names: list[str] = []
        for number, line in enumerate(text.splitlines(), 1):
            if not line.strip():
                continue
            if (row := record_in_cells(line, names)) is not None:
                found.append(row)
                continue
            try:
                found.append(_parse_line(line))
            except (ValueError, RecursionError) as error:
                if not found and not BEGINS.match(line.encode()):
                    # what a device says while it starts, or names of cells
                    names = cell_names(line)
                    continue
                self.damaged(f"line {number}", f"is no JSON: {error}"[:80])
        return found


def _parse_line(line: str) -> Any:
    """Contents of a line; the text before a record is its time or topic."""
    line = line.strip().rstrip(",")
    said = BEFORE.fullmatch(line)
    if said is None or not said[1]:
        return _parse_text(line)
    found = _parse_text(said[2])
    if isinstance(found, dict):
        for name, value in _said_before(said[1].strip()):
            found.setdefault(name, value)
    return found


def _said_before(text: str) -> Iterator[tuple[str, Any]]:
    """The time that a text before a record says, and its topic.

    >>> dict(_said_before("[1714746031.25][1250][imu]"))
    {'time': 1714746031.25, 'topic': 'imu'}
    >>> dict(_said_before("1250,")), dict(_said_before("lab/imu/1"))
    ({'time': 1250.0}, {'topic': 'lab/imu/1'})
    """
    clock = text.strip(" []:,;|")
    if is_clock(clock) or NUMBER.fullmatch(clock):
        yield CLOCK, clock if is_clock(clock) else float(clock)
        return
    if "[" not in text:
        yield "topic", text
        return
    parts = [(one[1] or one[2]).strip() for one in PART.finditer(text)]
    times = [one for one in parts if is_clock(one) or NUMBER.fullmatch(one)]
    for one in times[:1]:
        yield CLOCK, one if is_clock(one) else float(one)
    if words := [one for one in parts if one not in times]:
        yield "topic", " ".join(words)


def _parse_text(text: str) -> Any:
    """Contents of a text in JSON, or as Python prints it with single quotes."""
    try:
        return json.loads(text)
    except ValueError as error:
        for read in (python_value, values_side_by_side):
            try:
                return read(text)
            except ValueError:
                pass
        raise error from None
