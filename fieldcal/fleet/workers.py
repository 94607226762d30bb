"""Tasks for many items, in processes or on a Dask cluster; every item has a result.

A process that dies breaks its pool. The items that were running are then tried again,
one at a time. This identifies the item that kills its process; all others complete.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fieldcal.core.errors import InputError

T = TypeVar("T")

AHEAD = 2
"""Items submitted per worker, so that no worker waits for the next item."""

WITH_PORT = {"tcp", "tls", "ws", "wss"}
"""Schemes of Dask's addresses that name a host and a port."""

DIED = (
    "its process was killed, by the system for want of memory or processor time perhaps"
)


@dataclass(frozen=True, slots=True)
class WorkerPool:
    """Workers that carry out tasks.

    Attributes
    ----------
    open_executor : opens the executor; called again after it broke
    workers : number of workers

    """

    open_executor: Callable[[], contextlib.AbstractContextManager[Executor]]
    workers: int


def process_pool(count: int, preload: Sequence[str] = ()) -> WorkerPool:
    """Pool of `count` local processes; `preload` modules are imported once."""
    method = "forkserver"
    if method not in multiprocessing.get_all_start_methods():
        method = "spawn"
    context = multiprocessing.get_context(method)
    if method == "forkserver":
        context.set_forkserver_preload(list(preload))
    return WorkerPool(
        lambda: ProcessPoolExecutor(
            count, mp_context=context, initializer=_end_with_parent
        ),
        count,
    )


def _end_with_parent() -> None:
    """End this process when its parent process has ended for any reason."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def dask_pool(address: str) -> Iterator[WorkerPool]:
    """Pool of the workers of a running Dask scheduler.

    Raises
    ------
    InputError
        If Dask is not installed, `address` is none, or no scheduler or no worker is
        there.

    """
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "--scheduler needs Dask: pip install 'fieldcal[fleet]'"
        ) from error
    engine: Any = distributed  # it states types of some functions only
    _refuse_no_address(engine, address)
    try:
        client = engine.Client(address, set_as_default=False, timeout="10s")
    except OSError as error:
        raise InputError(
            f"{address}: no scheduler answers ({error}); start one with dask scheduler"
        ) from error
    with client:
        workers = sum(client.nthreads().values())
        if not workers:
            raise InputError(
                f"{address}: has no worker; start some with dask worker {address}"
                " --nthreads 1, where fieldcal is installed and the folders are"
            )
        yield WorkerPool(client.get_executor, workers)


def _refuse_no_address(engine: Any, address: str) -> None:
    """Refuse what Dask could not connect to: its client would wait, and then break."""
    try:
        scheme, place = engine.comm.parse_address(address)
        engine.comm.registry.get_backend(scheme)
        if scheme in WITH_PORT:
            engine.comm.parse_host_port(place)
    except ValueError as error:
        raise InputError(
            f"--scheduler {address}: is no address ({error}); write it as"
            " tcp://HOST:8786, as dask scheduler prints it"
        ) from error


@dataclass(frozen=True, slots=True)
class TaskResult(Generic[T]):
    """Result of an item: a value, or an error that says why there is none."""

    item: str
    value: T | None
    error: str = ""


def run_tasks(
    items: Sequence[str], work: Callable[[str], T], pool: WorkerPool
) -> Iterator[TaskResult[T]]:
    """Yield a result for each item in order of completion, even if processes die."""
    waiting, suspects = deque(items), deque[str]()
    while waiting or suspects:
        alone = bool(suspects)
        queue = suspects if alone else waiting
        running: dict[Future[T], str] = {}
        with pool.open_executor() as executor:
            try:
                while queue or running:
                    width = 1 if alone else AHEAD * pool.workers
                    while queue and len(running) < width:
                        running[executor.submit(work, queue[0])] = queue[0]
                        queue.popleft()
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        made = _task_result(running[future], future)
                        del running[future]
                        yield made
            except BrokenExecutor:
                if not alone:
                    suspects.extend(running.values())
                    continue
                yield from (
                    TaskResult(i, None, f"{i}: {DIED}") for i in running.values()
                )


def _task_result(item: str, future: Future[T]) -> TaskResult[T]:
    try:
        return TaskResult(item, future.result())
    except BrokenExecutor:
        raise
    except Exception as error:  # of the engine: the work has caught its own
        return TaskResult(item, None, f"{item}: {type(error).__name__}: {error}")
