"""Tables of a database of SQLite, as programs on telephones and servers keep them.

A table is a group with its name: ``accelerometer/timestamp``, ``accelerometer/x``. The
numbers of its columns are arrays; texts that are times of a clock are seconds. Where a
column of texts names devices or sensors, the rows of each are a group.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importers.arrays import ArrayFile
from fieldcal.importers.rosbag import SQLITE, TOPICS
from fieldcal.importing.arrays.array_groups import arrays_in_group
from fieldcal.importing.arrays.array_tables import ArrayTable, table_of
from fieldcal.importing.files.packed_stream import unpacked_file
from fieldcal.importing.text.instances import MAX_NAMED, MIN_ROWS
from fieldcal.importing.times.clock_text import ClockText, is_clock
from fieldcal.importing.times.name_changes import NameChanges
from fieldcal.importing.words.device_names import tells_devices, tells_wearers
from fieldcal.importing.words.heading_words import heading_meaning

WHAT = "databases of SQLite"

OWN = ("sqlite_", "android_metadata", "room_master_table")
"""Tables of which the database or a library keeps account for itself."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one, and is no bag of ROS 2."""
    return head.startswith(SQLITE) and TOPICS not in head


class SqliteLog(ArrayFile):
    """A database, with one IMU in its tables or several."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes: nothing."""
        return (), ""

    @contextmanager
    def _whole_arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Every column of numbers in its tables.

        Raises
        ------
        InputError
            If it is not whole.

        """
        if self._loaded is None:
            with unpacked_file(self.path, self.cut_off) as path:
                try:
                    with closing(_opened(path)) as database:
                        self._loaded = dict(_columns(database))
                except (sqlite3.Error, UnicodeDecodeError) as error:
                    raise InputError(
                        f"{self.path}: is not whole: {error}; copy it again from where"
                        " it came, with the file that ends in -wal, if there is one"
                    ) from error
        yield arrays_in_group(self.group, self._loaded)


def _opened(path: Path) -> sqlite3.Connection:
    """A database that is only read, also where its folder cannot be written to."""
    return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)


def _tables(database: sqlite3.Connection) -> list[str]:
    """Names of its tables."""
    rows = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
    return [name for (name,) in rows if not name.startswith(OWN)]


def _columns(database: sqlite3.Connection) -> Iterator[tuple[str, ArrayTable]]:
    """Columns of numbers, with the names of their tables, in the order of the rows."""
    names = _tables(database)
    for table in names:
        quoted = table.replace('"', '""')
        cursor = database.execute(f'SELECT * FROM "{quoted}"')  # noqa: S608
        called = [column[0] for column in cursor.description]
        rows = cursor.fetchall()
        prefix = f"{table}/" if names[1:] else ""
        for part, some in _parts(called, rows).items():
            for i, name in enumerate(called):
                values = _numbers([row[i] for row in some])
                if values is not None:
                    yield f"{prefix}{part}{name}", table_of(values)


def _parts(names: Sequence[str], rows: list[Any]) -> dict[str, list[Any]]:
    """Rows of each device or sensor by its name, where a column of texts tells them."""
    for tells in (tells_devices, tells_wearers):
        for i, name in enumerate(names):
            if not tells(name) or not all(isinstance(row[i], str) for row in rows):
                continue
            found: dict[str, list[Any]] = {}
            for row in rows:
                found.setdefault(f"{row[i].replace('/', ' ')}/", []).append(row)
            if 1 < len(found) <= MAX_NAMED and not _is_one(names, rows, i):
                return {n: some for n, some in found.items() if len(some) >= MIN_ROWS}
    return {"": rows}


def _is_one(names: Sequence[str], rows: Sequence[Any], i: int) -> bool:
    """Whether the time in rows goes on wherever the text in a column changes."""
    said = [heading_meaning(name) for name in names]
    for at, one in enumerate(said):
        if one is None or one.kind != "t":
            continue
        t = _numbers([row[at] for row in rows])
        if t is not None:
            changes = NameChanges()
            changes.feed(np.array([row[i] for row in rows]), t)
            return changes.go_on
    return False


def _numbers(cells: Sequence[Any]) -> Array | None:
    """Numbers (n,) of a column; None of other things."""
    known = [cell for cell in cells if cell is not None]
    if not known:
        return None
    if all(isinstance(cell, (int, float)) for cell in known):
        return np.array([np.nan if cell is None else cell for cell in cells], float)
    texts = [cell if isinstance(cell, str) else "" for cell in cells]
    if all(is_clock(text) for text in texts[:2]):
        clock = ClockText()
        read = (clock.seconds(text) for text in texts)
        return np.array([np.nan if since is None else since for since in read])
    try:
        return np.array([float(text) if text else np.nan for text in texts])
    except ValueError:
        return None
