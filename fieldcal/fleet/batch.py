"""Processing of many sessions: into the store, and from there into a Parquet file."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from fieldcal.core.errors import InputError, disk_says
from fieldcal.core.file_names import storable_text
from fieldcal.fleet.outcome import SessionTask, failed_session
from fieldcal.fleet.workers import WorkerPool, run_tasks
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.filters import LEVELS
from fieldcal.history.repeats import replacing_folders, shorter_copies
from fieldcal.history.sessions import StoredSession

CHUNK = 500
"""Number of sessions in a row group of the Parquet file."""


@dataclass(frozen=True, slots=True)
class SessionBatch:
    """Sessions to be processed with one task.

    Attributes
    ----------
    folders : session folders
    task : what to do with each session
    database : store that receives the results

    """

    folders: Sequence[Path]
    task: SessionTask
    database: Database

    def unprocessed(self) -> list[str]:
        """Sessions whose row in the store is missing or of other files or options.

        So are those whose row was replaced by a copy that is gone: a copy in another
        folder, stored later, counts instead of them.
        """
        known = self.database.run(sessions.fingerprints)
        replacing = self.database.run(replacing_folders)
        gone = {
            folder
            for folder, instead in replacing.items()
            if not any(Path(one).is_dir() for one in instead)
        }
        return [
            str(folder)
            for folder in self.folders
            if (mark := known.get(name := storable_text(str(folder)))) is None
            or name in gone
            or mark != self._fingerprint(folder)
        ]

    def _fingerprint(self, folder: Path) -> str | None:
        """Fingerprint of a session; None if its files cannot be read."""
        try:
            return self.task.fingerprint(folder)
        except OSError:
            return None

    def process(
        self, folders: Sequence[str], pool: WorkerPool
    ) -> Generator[StoredSession, None, None]:
        """Process folders; each result is in the store before it is yielded."""
        for made in run_tasks(folders, self.task, pool):
            yield self._store(made.value or failed_session(made.item, made.error or ""))

    def _store(self, one: StoredSession) -> StoredSession:
        """Store a result, or why it cannot be stored; returns what is stored.

        Raises
        ------
        InputError
            If the store takes no row at all.

        """
        try:
            self.database.run(lambda db: sessions.store_session(db, one), write=True)
        except Exception as error:  # one session costs no other, whatever it is
            said = f"{one.folder}: its result cannot be stored ({error}); see"
            said += " fieldcal verify, or report this with the session"
            refused = failed_session(one.folder, said)
            self.database.run(
                lambda db: sessions.store_session(db, refused), write=True
            )
            return refused
        return one

    def stored_rows(self) -> Iterator[list[StoredSession]]:
        """Yield the stored results of all folders, `CHUNK` at a time."""
        names = [str(folder) for folder in self.folders]
        for first in range(0, len(names), CHUNK):
            some = names[first : first + CHUNK]
            yield self.database.run(
                lambda db, some=some: sessions.find_sessions(
                    db, folders=some, documents=True, reduced=True
                )  # type: ignore[misc]
            )

    def shorter_copies(self) -> list[tuple[str, str]]:
        """Folders that a longer copy of their run replaces, each with the latter."""
        asked = {storable_text(str(folder)) for folder in self.folders}
        found = self.database.run(shorter_copies)
        return [pair for pair in found if pair[0] in asked]

    def write(self, path: Path) -> None:
        """Write the results as Parquet, one row per session, complete or not at all.

        Raises
        ------
        InputError
            If the file cannot be written.

        """
        names: dict[str, None] = {}
        for rows in self.stored_rows():
            names |= {n: None for one in rows for n in sorted(one.parameters)}
        table = parquet_schema(list(names))
        part = path.with_name(f".{path.name}.part")
        try:
            with pq.ParquetWriter(part, table) as out:
                for rows in self.stored_rows():
                    some = pa.Table.from_pylist([*map(_parquet_row, rows)], table)
                    out.write_table(some)
            part.replace(path)
        except OSError as error:
            raise InputError(
                f"{path}: cannot be written: {disk_says(error)}"
            ) from error
        finally:
            with suppress(OSError):  # a disk that is read-only, or gone
                part.unlink(missing_ok=True)


def parquet_schema(names: Sequence[str]) -> pa.Schema:
    """Return the columns; each parameter has one for its value and one for its ±."""
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


def _parquet_row(one: StoredSession) -> dict[str, object]:
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
