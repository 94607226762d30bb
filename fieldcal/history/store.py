"""Every calibration of every device, by its serial number: a SQLite file.

It is written after a calibration is done and read to judge the next one; nothing in it
ever enters an estimate. A calibration belongs to the family of its device if it was GO,
or was accepted by hand; an accepted one begins a new family, as after a repair.
"""

from __future__ import annotations

import contextlib
import json
import os
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fieldcal.calibration import Calibration
from fieldcal.core.documents import load_json
from fieldcal.core.errors import InputError

VERSION = 1
PLACE = "FIELDCAL_HISTORY"
"""Variable of the environment that names the file."""

WAIT = 10.0
"""How long another program may hold the file, s."""

TABLES = """
CREATE TABLE run (
    id INTEGER PRIMARY KEY,
    serial TEXT NOT NULL,
    taken_at TEXT NOT NULL,
    session TEXT NOT NULL,
    go INTEGER NOT NULL,
    accepted INTEGER NOT NULL DEFAULT 0,
    temperature REAL,
    latitude_deg REAL,
    height_m REAL,
    software TEXT NOT NULL,
    result TEXT NOT NULL,
    UNIQUE (serial, session)
);
CREATE TABLE parameter (
    run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE,
    name TEXT NOT NULL,
    value REAL NOT NULL,
    sigma REAL NOT NULL,
    unit TEXT NOT NULL,
    PRIMARY KEY (run, name)
);
"""


@dataclass(frozen=True, slots=True)
class HistoryRun:
    """One calibration.

    Attributes
    ----------
    number : by which it is named
    serial : of the device
    taken_at : when, ISO 8601 in UTC
    session : folder it was recorded in
    go : whether it was GO
    accepted : whether it was accepted by hand, and begins a family
    temperature : mean, deg C; None where unknown
    latitude_deg, height_m : the place; None where unknown
    software : what made it
    calibration : with its covariance

    """

    number: int
    serial: str
    taken_at: str
    session: str
    go: bool
    accepted: bool
    temperature: float | None
    latitude_deg: float | None
    height_m: float | None
    software: str
    calibration: Calibration


def default_path() -> Path:
    """The file: $FIELDCAL_HISTORY, or history.sqlite among the user's data."""
    if named := os.environ.get(PLACE):
        return Path(named)
    data = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(data) / "fieldcal" / "history.sqlite"


def family(runs: Sequence[HistoryRun]) -> tuple[HistoryRun, ...]:
    """The runs that a next one is compared with, in order."""
    begins = max((i for i, run in enumerate(runs) if run.accepted), default=0)
    return tuple(run for run in runs[begins:] if run.go or run.accepted)


class History:
    """The file, opened when it is asked.

    Parameters
    ----------
    path : where; made at the first calibration

    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def add(self, taken_at: str, session: Path, found: Calibration) -> None:
        """Keep a calibration; one of the same session is replaced.

        Raises
        ------
        InputError
            If the file cannot be written, or the device has no serial number.

        """
        document = found.to_json()
        serial = str(document.get("device", {}).get("serial", ""))
        if not serial:
            raise InputError("no history without a serial number: give --serial")
        conditions, site = document.get("conditions", {}), document.get("site", {})
        row = (
            serial,
            taken_at,
            str(session.resolve()),
            bool(document.get("decision", {}).get("go", False)),
            conditions.get("temperature_degc"),
            conditions.get("latitude_deg"),
            site.get("height_m"),
            str(document.get("software", "")),
            json.dumps(document),
        )
        with self._opened(write=True) as db:
            db.execute(
                "DELETE FROM run WHERE serial = ? AND session = ?", (row[0], row[2])
            )
            made = db.execute(
                "INSERT INTO run (serial, taken_at, session, go, temperature,"
                " latitude_deg, height_m, software, result)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                row,
            )
            sigmas, numbers = found.sigma.tolist(), found.values.tolist()
            rows = zip(found.names, numbers, sigmas, found.units, strict=True)
            db.executemany(
                "INSERT INTO parameter VALUES (?, ?, ?, ?, ?)",
                [(made.lastrowid, *r) for r in rows],
            )

    def serials(self) -> list[tuple[str, int, str]]:
        """Each device, how many calibrations it has, and when the last was."""
        with self._opened() as db:
            rows = db.execute(
                "SELECT serial, count(*), max(taken_at) FROM run GROUP BY serial"
            ).fetchall()
        return [(str(s), int(n), str(last)) for s, n, last in rows]

    def runs(self, serial: str) -> tuple[HistoryRun, ...]:
        """All calibrations of a device, oldest first.

        Raises
        ------
        InputError
            If the file cannot be read.

        """
        with self._opened() as db:
            rows = db.execute(
                "SELECT id, serial, taken_at, session, go, accepted, temperature,"
                " latitude_deg, height_m, software, result FROM run"
                " WHERE serial = ? ORDER BY taken_at, id",
                (serial,),
            ).fetchall()
        return tuple(self._run(row) for row in rows)

    def accept(self, serial: str, number: int) -> None:
        """Let a calibration begin a new family.

        Raises
        ------
        InputError
            If the device has no such calibration.

        """
        with self._opened(write=True) as db:
            done = db.execute(
                "UPDATE run SET accepted = 1 WHERE id = ? AND serial = ?",
                (number, serial),
            )
            if not done.rowcount:
                raise InputError(
                    f"{serial} has no calibration number {number}: see fieldcal"
                    f" history {serial}"
                )

    def _run(self, row: tuple[Any, ...]) -> HistoryRun:
        try:
            found = Calibration.from_json(load_json(row[-1]))
        except (ValueError, InputError) as error:
            raise InputError(
                f"{self.path}: calibration {row[0]} cannot be read ({error}); move the"
                " file away, or name another with --history"
            ) from error
        number, serial, at, session, go, accepted, *place, software = row[:10]
        temperature, latitude, height = place
        return HistoryRun(
            number,
            serial,
            at,
            session,
            bool(go),
            bool(accepted),
            temperature,
            latitude,
            height,
            software,
            found,
        )

    @contextlib.contextmanager
    def _opened(self, write: bool = False) -> Iterator[sqlite3.Connection]:
        """Open the file for one transaction; an empty one where there is none yet."""
        db: sqlite3.Connection | None = None
        try:
            if write:
                self.path.parent.mkdir(parents=True, exist_ok=True)
            there = write or self.path.exists()
            db = sqlite3.connect(
                self.path if there else ":memory:", timeout=WAIT, isolation_level=None
            )
            db.execute("PRAGMA foreign_keys = ON")
            db.execute("BEGIN IMMEDIATE" if write or not there else "BEGIN")
            self._prepare(db, write or not there)
            yield db
            db.execute("COMMIT")
        except (sqlite3.Error, OSError) as error:
            raise InputError(
                f"{self.path}: the history cannot be used ({error}); move the file"
                " away, or name another with --history"
            ) from error
        finally:
            if db is not None:
                db.close()

    def _prepare(self, db: sqlite3.Connection, may_make: bool) -> None:
        (version,) = db.execute("PRAGMA user_version").fetchone()
        if version == 0 and may_make:
            for statement in filter(str.strip, TABLES.split(";")):
                db.execute(statement)
            db.execute(f"PRAGMA user_version = {VERSION}")
        elif version != VERSION:
            raise InputError(
                f"{self.path}: is no history of this version (found {version}, this is"
                f" {VERSION}); name another with --history"
            )
