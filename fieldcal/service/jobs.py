"""Jobs: an upload, its state and its results, each job in a folder of its own.

A job becomes visible when it is complete: its folder is created under a name with a
leading dot, and then renamed. The same holds for its session and its results.
"""

from __future__ import annotations

import json
import re
import secrets
import shutil
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from fieldcal.core.errors import InputError, SessionError, disk_says
from fieldcal.service.bounds import ServiceBounds
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.lock import SessionLock

JobState = Literal["waiting", "working", "done", "failed"]

JOB_FILE, UPLOAD_FOLDER, SESSION_FOLDER, RESULTS_FOLDER = (
    "job.json",
    "upload",
    "session",
    "results",
)

FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
"""Permitted names of uploaded files: no path, no leading dot."""

JOB_ID = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True, slots=True)
class Job:
    """A job.

    Attributes
    ----------
    id : identifier of the job
    name : name of the uploaded file
    received_at : ISO 8601, UTC
    state : state of the job
    options : options of the import
    error : why there is no result, one sentence
    go, good : of the result; None without a decision, or without a result
    verdict : of the diagnosis
    log : output of the import

    """

    id: str
    name: str
    received_at: str
    state: JobState = "waiting"
    options: Mapping[str, str] = field(default_factory=dict)
    error: str | None = None
    go: bool | None = None
    good: bool | None = None
    verdict: str | None = None
    log: str = ""


@contextmanager
def held_folder(root: Path) -> Iterator[None]:
    """Hold the folder of all jobs: a second service would delete what arrives here.

    Raises
    ------
    InputError
        If another service holds it, or it cannot be written.

    """
    try:
        root.mkdir(parents=True, exist_ok=True)
        lock = SessionLock(root)
    except SessionError as error:
        raise InputError(
            f"{root}: another fieldcal serve keeps its sessions here: end that one"
            " first, or name another --folder"
        ) from error
    except OSError as error:
        raise InputError(f"{root}: cannot be written: {disk_says(error)}") from error
    try:
        yield
    finally:
        lock.release()


class JobStore:
    """All jobs of a service.

    Parameters
    ----------
    root : folder of all jobs
    bounds : number of jobs

    """

    def __init__(self, root: Path, bounds: ServiceBounds) -> None:
        self.root, self.bounds = root, bounds
        self._lock = threading.Lock()
        root.mkdir(parents=True, exist_ok=True)
        for part in root.glob(".*.part"):
            shutil.rmtree(part, ignore_errors=True)

    def folder(self, number: str) -> Path:
        """Folder of a job."""
        return self.root / number

    def all(self) -> list[Job]:
        """Every job, the latest first."""
        every = (self.get(path.name) for path in self.root.iterdir())
        found = [job for job in every if job is not None]
        return sorted(found, key=lambda j: (j.received_at, j.id), reverse=True)

    def get(self, number: str) -> Job | None:
        """A job; None if there is none with this id."""
        if not JOB_ID.fullmatch(number):
            return None
        try:
            return Job(
                **json.loads((self.folder(number) / JOB_FILE).read_text("utf-8"))
            )
        except (OSError, ValueError, TypeError):  # deleted, or not a job
            return None

    def unfinished(self) -> list[Job]:
        """Jobs that wait or are being processed, the earliest first."""
        return [j for j in reversed(self.all()) if j.state in ("waiting", "working")]

    def has_room(self) -> bool:
        """Whether one more job may be added."""
        return len(self.unfinished()) < self.bounds.jobs

    def begin_upload(self) -> Path:
        """Create a folder for an upload."""
        part = self.root / f".{secrets.token_hex(8)}.part"
        part.mkdir()
        return part

    def add_job(
        self, part: Path, name: str, received_at: str, options: Mapping[str, str]
    ) -> Job:
        """Add a job for an upload in a folder of `begin_upload`.

        Raises
        ------
        InputError
            If too many jobs wait already.

        """
        job = Job(part.name[1:-5], name, received_at, options=dict(options))
        write_atomically(part / JOB_FILE, json.dumps(asdict(job)))
        with self._lock:
            if not self.has_room():
                raise InputError(
                    f"{self.bounds.jobs} recordings wait already: send it again later"
                )
            part.rename(self.folder(job.id))
        self._make_room()
        return job

    def update(self, job: Job, **what: Any) -> Job:
        """Store changed fields of a job, unless it was deleted meanwhile."""
        job = replace(job, **what)
        with self._lock:
            if self.folder(job.id).is_dir():
                write_atomically(
                    self.folder(job.id) / JOB_FILE, json.dumps(asdict(job))
                )
        return job

    def remove(self, number: str) -> bool:
        """Delete a job with all its files; returns whether there was one."""
        gone = self.root / f".{number}.part"
        with self._lock:  # two may delete it at the same time
            if self.get(number) is None:
                return False
            self.folder(number).rename(gone)
        shutil.rmtree(gone, ignore_errors=True)
        return True

    def documents(self, number: str) -> list[str]:
        """Names of the documents of a job."""
        try:
            folder = self.folder(number) / RESULTS_FOLDER
            return sorted(path.name for path in folder.iterdir())
        except OSError:  # none yet, or deleted
            return []

    def _make_room(self) -> None:
        """Delete the oldest jobs that are over, unless the disk refuses."""
        over = [j for j in self.all() if j.state in ("done", "failed")]
        for job in over[self.bounds.kept :]:
            with suppress(OSError):
                self.remove(job.id)
