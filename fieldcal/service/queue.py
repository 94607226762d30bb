"""Carries out jobs in order, each in a process of its own or on an engine."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from sqlalchemy.exc import DataError

from fieldcal.core.errors import FieldcalError
from fieldcal.fleet.workers import WorkerPool, run_tasks
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.repeats import withdraw
from fieldcal.history.sessions import StoredSession
from fieldcal.service.jobs import SESSION_FOLDER, Job, JobStore
from fieldcal.service.work import JobTask, without_paths

RETRY_INTERVAL = 10.0
"""Time after which a job is repeated whose result could not be stored, s."""


class JobQueue:
    """Carries out jobs in the order of their arrival; a context manager.

    Parameters
    ----------
    jobs : the jobs to carry out
    database : stores the results
    pool : worker processes
    task : function that processes the folder of a job

    """

    def __init__(
        self, jobs: JobStore, database: Database, pool: WorkerPool,
        task: Callable[[str], StoredSession] | None = None,
    ) -> None:  # fmt: skip
        self.jobs, self.database, self.pool = jobs, database, pool
        self.task = task or JobTask(jobs.bounds)
        self._come, self._over = threading.Event(), False
        self._storing = threading.Lock()
        self._thread = threading.Thread(target=self._work, daemon=True)

    def __enter__(self) -> JobQueue:
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._over = True
        self._come.set()
        # an unfinished job is repeated at the next start
        self._thread.join(timeout=1.0)

    def notify(self) -> None:
        """Tell the queue that there is a job."""
        self._come.set()

    def delete(self, number: str) -> bool:
        """Delete a job with its files and its result in the store.

        Returns whether there was one.

        Raises
        ------
        FieldcalError
            If the store cannot be written; then nothing is deleted.

        """
        folder = self.jobs.folder(number)
        mine = [str(folder), str(folder / SESSION_FOLDER)]
        with self._storing:
            if self.jobs.get(number) is None:
                return False
            self.database.run(lambda db: withdraw(db, mine), write=True)
            return self.jobs.remove(number)

    def _work(self) -> None:
        while not self._over:
            self._come.clear()
            waiting = self.jobs.unfinished()
            if not waiting:
                self._come.wait()
                continue
            try:
                self._process(waiting[0])
            except Exception:  # until the disk or the store can be written
                self._come.wait(RETRY_INTERVAL)

    def _process(self, job: Job) -> None:
        job = self.jobs.update(job, state="working")
        folder = self.jobs.folder(job.id)
        for made in run_tasks([str(folder)], self.task, self.pool):
            one = made.value or StoredSession(made.item, error=made.error)
            with self._storing:
                if self.jobs.get(job.id) is None:
                    continue  # deleted meanwhile: nothing of it is kept
                said = one.error if one.error is not None else self._store(job, one)
            log = Path(folder / "import.log")
            with suppress(OSError):
                job = self.jobs.update(job, log=log.read_text("utf-8"))
            self.jobs.update(
                job,
                state="done" if said is None else "failed",
                error=said and without_paths(folder, said),
                go=one.go,
                good=one.good,
                verdict=(one.diagnosis or {}).get("verdict"),
            )

    def _store(self, job: Job, one: StoredSession) -> str | None:
        """Store a result; returns why it can never be stored, or None.

        Raises
        ------
        FieldcalError
            If the store cannot be written now; the job states it.

        """
        try:
            self.database.run(lambda db: sessions.store_session(db, one), write=True)
        except Exception as error:
            if isinstance(error, FieldcalError) and not isinstance(
                error.__cause__, DataError
            ):
                later = "its result cannot be stored now and is tried again"
                self.jobs.update(job, state="waiting", error=later)
                raise
            return (
                f"its result cannot be stored ({type(error).__name__}); have whoever"
                " keeps this service report it with the session"
            )
        return None
