"""One job after the other, each in a process of its own or on an engine."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from fieldcal.core.errors import FieldcalError
from fieldcal.fleet.workers import WorkerPool, run_tasks
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.service.jobs import Job, Jobs
from fieldcal.service.work import JobTask

AGAIN = 10.0
"""Time after which a job is tried again that could not be written down, s."""


class JobQueue:
    """Carries out jobs in the order in which they came; a context manager.

    Parameters
    ----------
    jobs : to be done
    database : where results go
    pool : what does them
    task : with each

    """

    def __init__(
        self, jobs: Jobs, database: Database, pool: WorkerPool,
        task: Callable[[str], StoredSession] | None = None,
    ) -> None:  # fmt: skip
        self.jobs, self.database, self.pool = jobs, database, pool
        self.task = task or JobTask(jobs.bounds)
        self._come, self._over = threading.Event(), False
        self._thread = threading.Thread(target=self._work, daemon=True)

    def __enter__(self) -> JobQueue:
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._over = True
        self._come.set()
        # what is under way is done again at the next start
        self._thread.join(timeout=1.0)

    def come(self) -> None:
        """Say that there is a job."""
        self._come.set()

    def _work(self) -> None:
        while not self._over:
            self._come.clear()
            waiting = self.jobs.waiting()
            if not waiting:
                self._come.wait()
                continue
            try:
                self._done(waiting[0])
            except (FieldcalError, OSError):
                self._come.wait(AGAIN)  # for room on the disk, or a store

    def _done(self, job: Job) -> None:
        job = self.jobs.changed(job, state="working")
        folder = self.jobs.folder(job.id)
        for made in run_tasks([str(folder)], self.task, self.pool):
            one = made.value or StoredSession(made.item, error=made.error)
            said = one.error
            if said is None:
                try:
                    self.database.done(lambda db, one=one: sessions.keep(db, one), True)  # type: ignore[misc]
                except FieldcalError as error:
                    said = str(error)
            log = Path(folder / "import.log")
            with suppress(OSError):
                job = self.jobs.changed(job, log=log.read_text("utf-8"))
            self.jobs.changed(
                job,
                state="done" if said is None else "failed",
                error=said and said.replace(f"{folder}: ", ""),
                go=one.go,
                good=one.good,
                verdict=(one.diagnosis or {}).get("verdict"),
            )
