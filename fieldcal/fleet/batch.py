"""Trees of sessions into the store and into Parquet."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from fieldcal.fleet.outcome import SessionTask
from fieldcal.fleet.tree import fingerprint
from fieldcal.fleet.workers import Pool, results
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import LEVELS, StoredSession

CHUNK = 500
"""Sessions of one row group."""


@dataclass(frozen=True, slots=True)
class SessionBatch:
    """What is to be done.

    Attributes
    ----------
    folders : of the sessions
    task : with each
    database : the store

    """

    folders: Sequence[Path]
    task: SessionTask
    database: Database

    def left(self) -> list[str]:
        """Sessions whose row in the store is not of these files and this task."""
        known = self.database.done(sessions.fingerprints)
        options = self.task.options
        return [
            str(folder)
            for folder in self.folders
            if known.get(str(folder)) != fingerprint(folder, options)
        ]

    def carried_out(
        self, folders: Sequence[str], pool: Pool
    ) -> Generator[StoredSession, None, None]:
        """Sessions as they are done, each in the store before it is given."""
        for made in results(folders, self.task, pool):
            one = made.value or StoredSession(made.item, error=made.error)
            self.database.done(lambda db, one=one: sessions.keep(db, one), write=True)  # type: ignore[misc]
            yield one

    def stored(self) -> Iterator[list[StoredSession]]:
        """Rows of the store, some at a time."""
        names = [str(folder) for folder in self.folders]
        for first in range(0, len(names), CHUNK):
            some = names[first : first + CHUNK]
            yield self.database.done(
                lambda db, some=some: sessions.found(
                    db, folders=some, documents=True, reduced=True
                )  # type: ignore[misc]
            )

    def write(self, path: Path) -> None:
        """Write the results as Parquet, one row a session, whole or not at all."""
        names: dict[str, None] = {}
        for rows in self.stored():
            names |= {n: None for one in rows for n in sorted(one.parameters)}
        table = schema(list(names))
        part = path.with_name(f".{path.name}.part")
        with pq.ParquetWriter(part, table) as out:
            for rows in self.stored():
                out.write_table(pa.Table.from_pylist([*map(_row, rows)], table))
        part.replace(path)


def schema(names: Sequence[str]) -> pa.Schema:
    """Columns of the table; each parameter has one for its value and its ±."""
    text, number, truth = pa.string(), pa.float64(), pa.bool_()
    return pa.schema(
        [
            *((n, text) for n in ("folder", "serial", *LEVELS, "taken_at", "error")),
            *((n, truth) for n in ("go", "good")),
            ("verdict", text),
            ("effects", pa.map_(text, number)),
            *((f"{n}{end}", number) for n in names for end in ("", ".sigma")),
        ]
    )


def _row(one: StoredSession) -> dict[str, object]:
    found = one.diagnosis or {}
    effects = [(e["id"], e["probability"]) for e in found.get("effects", ())]
    return {
        "folder": one.folder,
        "serial": one.serial,
        **one.levels,
        "taken_at": one.taken_at,
        "error": one.error,
        "go": one.go,
        "good": one.good,
        "verdict": found.get("verdict"),
        "effects": effects,
        **{name: value for name, (value, _, _) in one.parameters.items()},
        **{f"{name}.sigma": sigma for name, (_, sigma, _) in one.parameters.items()},
    }
