"""Work in processes: each item has one result, whatever happens to them."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from processes import HANGS

from fieldcal.core.errors import InputError
from fieldcal.fleet.workers import WorkerPool, dask_pool, process_pool, run_tasks


def carried_out(item: str) -> str:
    """Ends the process of items that say so."""
    if item.startswith("kill"):
        os.kill(os.getpid(), signal.SIGKILL)
    return item.upper()


def test_a_process_that_is_killed_costs_its_own_item_only() -> None:
    items = [*map(str, range(6)), "kill a", *map(str, range(6, 12)), "kill b"]
    found = list(run_tasks(items, carried_out, process_pool(2, [__name__])))
    assert sorted(one.item for one in found) == sorted(items), "each once"
    lost = {one.item: one.error for one in found if one.value is None}
    assert set(lost) == {"kill a", "kill b"}
    assert all("its process was killed" in said for said in lost.values())


def test_an_engine_that_gives_up_an_item_goes_on_with_the_others() -> None:
    def refused(item: str) -> str:
        if item == "b":
            raise RuntimeError("its workers died")
        return item

    pool = WorkerPool(lambda: ThreadPoolExecutor(2), 2)
    found = {one.item: one for one in run_tasks(["a", "b", "c"], refused, pool)}
    assert found["b"].error == "b: RuntimeError: its workers died"
    assert found["a"].value == "a" and found["c"].value == "c"


def test_no_more_is_given_out_than_keeps_workers_busy() -> None:
    given: list[str] = []

    class Counting(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any) -> Any:  # type: ignore[override]
            given.append(args[0])
            return super().submit(fn, *args)

    items = [str(i) for i in range(50)]
    some: Iterator[object] = run_tasks(
        items, str.upper, WorkerPool(lambda: Counting(1), 1)
    )
    next(some)
    assert len(given) <= 3


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_of_dask_does_the_same() -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=2,
            processes=False,
            dashboard_address=None,
        ) as cluster,
        dask_pool(cluster.scheduler_address) as pool,
    ):
        assert pool.workers == 2
        found = {one.value for one in run_tasks(["a", "b", "c"], str.upper, pool)}
    assert found == {"A", "B", "C"}


@pytest.mark.parametrize("address", ["nonsense://1", "127.0.0.1", "tcp://h:x", ""])
def test_an_address_of_no_scheduler_is_refused_at_once(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(distributed, "Client", None)  # it would wait for minutes
    with pytest.raises(InputError, match="is no address .*write it as tcp://HOST"):
        with dask_pool(address):
            raise AssertionError


def test_a_scheduler_that_does_not_answer_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    distributed = pytest.importorskip("distributed")

    def absent(*_: object, **__: object) -> None:
        raise OSError("nobody is there")

    monkeypatch.setattr(distributed, "Client", absent)
    with pytest.raises(InputError, match=r"answers \(nobody is there\); start one"):
        with dask_pool("tcp://127.0.0.1:1"):
            raise AssertionError


def test_a_pool_that_cannot_be_opened_again_says_so() -> None:
    @contextlib.contextmanager
    def shut() -> Iterator[Executor]:
        raise InputError("the engine is gone")
        yield

    with pytest.raises(InputError, match="is gone"):
        list(run_tasks(["a"], str.upper, WorkerPool(shut, 1)))


ALONE = """
import os, pathlib, time
from fieldcal.fleet.workers import process_pool, run_tasks
def stay(path):
    pathlib.Path(path).write_text(str(os.getpid()))
    time.sleep(1000)
if __name__ == "__main__":
    list(run_tasks([{there!r}], stay, process_pool(1)))
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc")
def test_workers_end_with_the_process_that_they_work_for(tmp_path: Path) -> None:
    script, there = tmp_path / "script.py", tmp_path / "worker"
    script.write_text(ALONE.format(there=str(there)))
    with subprocess.Popen([sys.executable, str(script)]) as process:
        until = time.monotonic() + HANGS
        while not (there.exists() and there.read_text()):
            assert time.monotonic() < until and process.poll() is None
            time.sleep(0.02)
        process.kill()
    worker = int(there.read_text())
    while _runs(worker):
        assert time.monotonic() < until
        time.sleep(0.02)


def _runs(number: int) -> bool:
    """Whether a process is there and is more than its exit code."""
    try:
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
