"""Jobs at the same time, beyond their limits, and with a store that is not there."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import sys
import threading
import time
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from processes import HANGS
from session_folders import places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.errors import FieldcalError
from fieldcal.core.samples import Block
from fieldcal.fleet.workers import WorkerPool, process_pool, run_tasks
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.service import limits, queue
from fieldcal.service.bounds import MIB, ServiceBounds
from fieldcal.service.jobs import Job, JobStore, held_folder
from fieldcal.service.own_process import run_in_own_process
from fieldcal.service.queue import JobQueue
from fieldcal.service.work import JobTask, without_paths
from fieldcal.session.sample_table import to_record_batch
from fieldcal.sim_device.profile import Profile

T = TypeVar("T")
TOGETHER = 4


def together(work: Callable[[int], T]) -> list[T]:
    """Results of `work`, called in as many threads at the same time."""
    barrier = threading.Barrier(TOGETHER)

    def one(number: int) -> T:
        barrier.wait(HANGS)
        return work(number)

    with ThreadPoolExecutor(TOGETHER) as pool:
        return list(pool.map(one, range(TOGETHER)))


def uploaded(jobs: JobStore, data: bytes = b"x", name: str = "x") -> Path:
    part = jobs.begin_upload()
    (part / "upload").mkdir()
    (part / "upload" / name).write_bytes(data)
    return part


def added(jobs: JobStore, data: bytes = b"x", name: str = "x") -> Job:
    return jobs.add_job(uploaded(jobs, data, name), name, "2026-01-01", {})


def zipped(folder: Path, **more: bytes) -> bytes:
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(folder.iterdir()):
            archive.write(file, file.name)
        for name, data in more.items():
            archive.writestr(name, data)
    return path.read_bytes()


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of two positions."""
    held = places([(0.0, 0.0), (45.0, 5.0)], seconds=6.0, gap=6.0)
    block = recorded(Profile(), held, seed=1)
    folder = tmp_path_factory.mktemp("sent") / "unit-7"
    return write_session(folder, block, held, device={"serial": "A7"})


class Moment(JobStore):
    """Jobs of which all are looked at by all threads before one is deleted."""

    def __init__(self, root: Path, bounds: ServiceBounds) -> None:
        super().__init__(root, bounds)
        self.looked = threading.Barrier(TOGETHER)

    def get(self, number: str) -> Job | None:
        found = super().get(number)
        if not self._lock.locked():
            self.looked.wait(HANGS)
        return found


def test_one_of_those_who_delete_a_job_at_once_has_deleted_it(tmp_path: Path) -> None:
    number = added(JobStore(tmp_path, ServiceBounds())).id
    jobs = Moment(tmp_path, ServiceBounds())
    assert sorted(together(lambda _: jobs.remove(number))) == [False] * 3 + [True]
    assert list(tmp_path.iterdir()) == []


def test_a_second_service_on_the_same_folder_deletes_nothing_that_arrives(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with held_folder(tmp_path):
        part = uploaded(JobStore(tmp_path, ServiceBounds()))
        store = str(tmp_path / "h.sqlite")
        call = ["serve", "--listen", "192.0.2.1:1", "--folder", str(tmp_path)]
        assert main([*call, "--history", store]) == 2
        assert "another fieldcal serve" in capsys.readouterr().err
        assert part.is_dir()
    with held_folder(tmp_path):
        pass


def test_a_folder_that_cannot_be_made_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    call = ["serve", "--folder", str(tmp_path / "file" / "srv")]
    assert main([*call, "--history", str(tmp_path / "h.sqlite")]) == 2
    assert "srv: cannot be written: a file is in the way" in capsys.readouterr().err


def test_an_upload_is_taken_in_although_an_old_job_cannot_be_deleted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = JobStore(tmp_path, ServiceBounds(kept=1))
    for _ in range(2):
        jobs.update(added(jobs), state="done")

    def refused(_: str) -> bool:
        raise PermissionError("it cannot be deleted")

    monkeypatch.setattr(jobs, "remove", refused)
    assert jobs.get(added(jobs).id)


def test_uploads_at_the_same_time_are_all_taken_in(tmp_path: Path) -> None:
    jobs = JobStore(tmp_path, ServiceBounds(kept=2))
    for _ in range(6):
        jobs.update(added(jobs), state="done")
    parts = [uploaded(jobs) for _ in range(TOGETHER)]
    made = together(lambda i: jobs.add_job(parts[i], "x", "2026-02-01", {}))
    assert {job.id for job in made} == {job.id for job in jobs.unfinished()}
    assert len(jobs.all()) == TOGETHER + 2


def test_documents_of_a_job_that_is_deleted_are_none(tmp_path: Path) -> None:
    assert JobStore(tmp_path, ServiceBounds()).documents("0" * 16) == []


def burn(_: object, folder: Path) -> Path:
    """A job that never ends."""
    with (folder / "attempts").open("a") as file:
        file.write("once\n")
    while True:
        pass


@pytest.mark.thorough
def test_a_job_beyond_its_processor_time_says_so_and_is_not_tried_again(
    tmp_path: Path,
) -> None:
    (made,) = run_tasks([str(tmp_path)], Endless(), process_pool(1))
    assert (tmp_path / "attempts").read_text() == "once\n"
    assert made.value is not None
    assert "more than 0.0166667 min of processor time" in (made.value.error or "")
    assert "--minutes" in (made.value.error or "")


class Endless:
    """A task that makes a session for ever, with a second of processor time."""

    def __call__(self, folder: str) -> StoredSession:
        JobTask._session = burn  # type: ignore[method-assign, assignment]
        return JobTask(ServiceBounds(seconds=1))(folder)


def test_limits_hold_for_the_job_only() -> None:
    """In a thread, where a limit would kill the whole process, there are none."""
    before = [resource.getrlimit(what) for what in limits.LIMITED]
    handler = signal.getsignal(signal.SIGXCPU)

    def inside() -> tuple[object, int]:
        with limits.resource_limits(ServiceBounds(seconds=10**6, memory=1 << 40)):
            cores = resource.getrlimit(resource.RLIMIT_CORE)
            return signal.getsignal(signal.SIGXCPU), cores[0]

    found, cores = inside()
    assert found is not handler and cores == 0
    with ThreadPoolExecutor(1) as pool, pytest.raises(ValueError, match="main thread"):
        pool.submit(inside).result()
    assert [resource.getrlimit(what) for what in limits.LIMITED] == before
    assert signal.getsignal(signal.SIGXCPU) is handler


class Burning(JobTask):
    """A task that makes a session for ever, also in a process of its own."""

    def _session(self, place: Path) -> Path:
        return burn(self, place)


def test_a_worker_in_a_thread_survives_a_job_beyond_its_processor_time(
    tmp_path: Path, session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a worker of Dask is one: killed, it would lose others and be tried again."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    bounds = ServiceBounds(seconds=1)
    jobs = JobStore(tmp_path, bounds)
    folder = str(jobs.folder(added(jobs, zipped(session), "s.zip").id))
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    (made,) = run_tasks([folder], Burning(bounds), pool)
    assert made.value is not None and made.value.error is not None, made
    assert made.value.error.startswith("took more than 0.0166667 min of processor time")


def ends_itself(folder: str) -> StoredSession:
    sys.stdout.write("no part of the result\n")
    if folder == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    return StoredSession(folder, str(os.getpid()))


def test_a_process_of_its_own_costs_its_caller_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    found = run_in_own_process(ends_itself, "whole")
    assert found.error is None and found.serial not in ("", str(os.getpid()))
    found = run_in_own_process(ends_itself, "killed")
    assert found.result is None and "its process was killed" in (found.error or "")


@pytest.mark.skipif(sys.platform != "linux", reason="no such limit elsewhere")
def test_a_small_file_of_many_rows_is_refused_with_a_reason(
    tmp_path: Path, session: Path
) -> None:
    many = 4_000_000
    folder = shutil.copytree(session, tmp_path / "bomb")
    (folder / "samples.arrows").unlink()
    still = np.zeros((many, 3))
    batch = to_record_batch(Block.of(np.arange(many) / 1e3, still, still), nulls=True)
    pq.write_table(
        pa.Table.from_batches([batch]), folder / "samples.parquet", compression="zstd"
    )
    bounds = ServiceBounds(memory=320 * MIB)
    jobs = JobStore(tmp_path / "jobs", bounds)
    job = added(jobs, zipped(folder), "bomb.zip")
    (made,) = run_tasks([str(jobs.folder(job.id))], JobTask(bounds), process_pool(1))
    assert made.value is not None and made.value.error is not None, made
    said = "samples.parquet: needs more memory than there is, or is damaged; copy it"
    assert made.value.error.startswith(said)


def test_a_job_that_runs_out_of_memory_says_its_limit(
    tmp_path: Path, session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("fieldcal.fleet.outcome.usable_windows", full)
    jobs, task = JobStore(tmp_path, ServiceBounds()), JobTask(ServiceBounds())
    made = task(str(jobs.folder(added(jobs, zipped(session), "s.zip").id)))
    assert (made.error or "").startswith("needs more than 4096 MiB of memory: send a")


def test_names_in_an_archive_are_bounded(tmp_path: Path, session: Path) -> None:
    jobs = JobStore(tmp_path / "jobs", ServiceBounds())
    long = zipped(session, **{"n" * 300: b"1"})
    folder = str(jobs.folder(added(jobs, long, "s.zip").id))
    said = JobTask(ServiceBounds())._session
    with pytest.raises(FieldcalError, match="longer than 100 characters: rename"):
        said(Path(folder))


def test_an_archive_that_cannot_be_unpacked_tells_no_path(
    tmp_path: Path, session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device", str(tmp_path))

    jobs = JobStore(tmp_path / "jobs", ServiceBounds())
    folder = jobs.folder(added(jobs, zipped(session), "s.zip").id)
    monkeypatch.setattr("zipfile.ZipFile.open", full)
    with pytest.raises(FieldcalError, match="No space left on device") as told:
        JobTask(ServiceBounds())._session(folder)
    assert str(tmp_path) not in str(told.value)


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("/srv/jobs/1/session/samples.csv: is bad", "samples.csv: is bad"),
        ("OSError: [Errno 2] no: '/srv/jobs/1/upload/x'", "OSError: [Errno 2] no: 'x'"),
        ("broke: send in /tmp/broke-x.txt, which", "broke: send in broke-x.txt, which"),
        ("0.3 m/s^2, 5 deg/s/g and a/b/c", "0.3 m/s^2, 5 deg/s/g and a/b/c"),
    ],
)  # fmt: skip
def test_no_path_of_this_computer_is_said(text: str, left: str) -> None:
    assert without_paths(Path("/srv/jobs/1"), text) == left


def quick(folder: str) -> StoredSession:
    return StoredSession(folder, "A1", go=True, good=True, result={})


def broken(folder: str) -> StoredSession:
    return StoredSession(folder, "A1", result={"x": {1}})


def over(jobs: JobStore, number: str) -> Job:
    """A job when it is over."""
    until = time.monotonic() + HANGS
    while time.monotonic() < until:
        job = jobs.get(number)
        assert job is not None
        if job.state in ("done", "failed"):
            return job
        time.sleep(0.01)
    raise AssertionError("the job never ended")


def test_a_job_whose_result_cannot_be_stored_is_repeated_until_it_can(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(queue, "RETRY_INTERVAL", 0.01)
    jobs, place = JobStore(tmp_path / "jobs", ServiceBounds()), tmp_path / "deep" / "h"
    place.parent.write_text("a file is in the way of the folder")
    number, pool = added(jobs).id, WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    with JobQueue(jobs, Database(place), pool, quick):
        until, told = time.monotonic() + HANGS, None
        while not told and time.monotonic() < until:
            told = (jobs.get(number) or added(jobs)).error
        assert told == "its result cannot be stored now and is tried again"
        place.parent.unlink()
        job = over(jobs, number)
    assert (job.state, job.error, job.go) == ("done", None, True)
    (stored,) = Database(place).run(sessions.find_sessions)
    assert stored.serial == "A1"


def test_nothing_is_stored_of_a_job_that_was_deleted_meanwhile(tmp_path: Path) -> None:
    jobs, pool = (
        JobStore(tmp_path / "jobs", ServiceBounds()),
        WorkerPool(lambda: ThreadPoolExecutor(1), 1),
    )
    first = added(jobs).id

    def task(folder: str) -> StoredSession:
        if folder.endswith(first):
            assert jobs.remove(first)
        return quick(folder)

    with JobQueue(jobs, Database(tmp_path / "h"), pool, task) as made:
        second = added(jobs).id
        made.notify()
        assert over(jobs, second).state == "done"
    (stored,) = Database(tmp_path / "h").run(sessions.find_sessions)
    assert stored.folder == str(jobs.folder(second))


def test_a_result_that_can_never_be_stored_holds_up_no_other(tmp_path: Path) -> None:
    jobs, pool = (
        JobStore(tmp_path, ServiceBounds()),
        WorkerPool(lambda: ThreadPoolExecutor(1), 1),
    )
    first = added(jobs).id

    def task(folder: str) -> StoredSession:
        return (broken if folder.endswith(first) else quick)(folder)

    with JobQueue(jobs, Database(tmp_path.with_suffix(".h")), pool, task) as made:
        assert "its result cannot be stored (TypeError)" in (
            over(jobs, first).error or ""
        )
        second = added(jobs).id
        made.notify()
        assert over(jobs, second).state == "done"


def test_the_error_of_a_task_tells_no_path(tmp_path: Path) -> None:
    def task(folder: str) -> StoredSession:
        raise OSError(2, "No such file", f"{folder}/session/x")

    jobs, pool = (
        JobStore(tmp_path, ServiceBounds()),
        WorkerPool(lambda: ThreadPoolExecutor(1), 1),
    )
    number = added(jobs).id
    with JobQueue(jobs, Database(tmp_path / "h"), pool, task):
        job = over(jobs, number)
    assert job.state == "failed" and "No such file" in (job.error or "")
    assert str(tmp_path) not in (job.error or "")
