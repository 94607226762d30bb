"""Jobs: what was sent, how far it is, and what was made of it; each a folder.

A job is there when it is whole: it is made under a name with a dot and then gets its
own. So are its session and its results.
"""

from __future__ import annotations

import json
import re
import secrets
import shutil
import threading
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from fieldcal.core.errors import InputError
from fieldcal.service.bounds import Bounds
from fieldcal.session.folder import write_atomically

State = Literal["waiting", "working", "done", "failed"]

JOB, UPLOAD, SESSION, RESULTS = "job.json", "upload", "session", "results"

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
"""Of what is sent: no path, nothing hidden."""

NUMBER = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True, slots=True)
class Job:
    """A job.

    Attributes
    ----------
    id : by which it is asked for
    name : of what was sent
    received_at : ISO 8601, UTC
    state : how far it is
    options : what was said of the recording
    error : why there is no result, in a sentence
    go, good : of the result; None where nobody judged, or there is none
    verdict : of the diagnosis
    log : what import said

    """

    id: str
    name: str
    received_at: str
    state: State = "waiting"
    options: Mapping[str, str] = field(default_factory=dict)
    error: str | None = None
    go: bool | None = None
    good: bool | None = None
    verdict: str | None = None
    log: str = ""


class Jobs:
    """All jobs of a service.

    Parameters
    ----------
    root : folder of all of them
    bounds : how many

    """

    def __init__(self, root: Path, bounds: Bounds) -> None:
        self.root, self.bounds = root, bounds
        self._lock = threading.Lock()
        root.mkdir(parents=True, exist_ok=True)
        for part in root.glob(".*.part"):
            shutil.rmtree(part, ignore_errors=True)

    def folder(self, number: str) -> Path:
        """Where a job is."""
        return self.root / number

    def all(self) -> list[Job]:
        """Every job, the latest first."""
        every = (self.get(path.name) for path in self.root.iterdir())
        found = [job for job in every if job is not None]
        return sorted(found, key=lambda j: (j.received_at, j.id), reverse=True)

    def get(self, number: str) -> Job | None:
        """A job; None where there is none."""
        if not NUMBER.fullmatch(number):
            return None
        try:
            return Job(**json.loads((self.folder(number) / JOB).read_text("utf-8")))
        except (OSError, ValueError, TypeError):  # taken away, or somebody else's
            return None

    def waiting(self) -> list[Job]:
        """Jobs that are not over, the earliest first."""
        return [j for j in reversed(self.all()) if j.state in ("waiting", "working")]

    def room(self) -> bool:
        """Whether one more may wait."""
        return len(self.waiting()) < self.bounds.jobs

    def begun(self) -> Path:
        """A folder for a job that is being sent."""
        part = self.root / f".{secrets.token_hex(8)}.part"
        part.mkdir()
        return part

    def added(
        self, part: Path, name: str, received_at: str, options: Mapping[str, str]
    ) -> Job:
        """A job of what was sent into a folder.

        Raises
        ------
        InputError
            If as many wait as may.

        """
        job = Job(part.name[1:-5], name, received_at, options=dict(options))
        write_atomically(part / JOB, json.dumps(asdict(job)))
        with self._lock:
            if not self.room():
                raise InputError(
                    f"{self.bounds.jobs} recordings wait already: send it again later"
                )
            part.rename(self.folder(job.id))
        self._make_room()
        return job

    def changed(self, job: Job, **what: Any) -> Job:
        """Write down how far a job is; nothing where it was taken away meanwhile."""
        job = replace(job, **what)
        with self._lock:
            if self.folder(job.id).is_dir():
                write_atomically(self.folder(job.id) / JOB, json.dumps(asdict(job)))
        return job

    def removed(self, number: str) -> bool:
        """Take a job away with all that is its; whether there was one."""
        if self.get(number) is None:
            return False
        gone = self.root / f".{number}.part"
        with self._lock:
            self.folder(number).rename(gone)
        shutil.rmtree(gone, ignore_errors=True)
        return True

    def documents(self, number: str) -> list[str]:
        """Names of what was made."""
        folder = self.folder(number) / RESULTS
        return sorted(p.name for p in folder.iterdir()) if folder.is_dir() else []

    def _make_room(self) -> None:
        over = [j for j in self.all() if j.state in ("done", "failed")]
        for job in over[self.bounds.kept :]:
            self.removed(job.id)
