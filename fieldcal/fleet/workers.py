"""Work on many items in processes, or on an engine that is there; none is lost.

A process that dies takes its pool with it. What was under way then is tried again, one
item at a time, so that the one that kills its process is known and all others are done.
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
"""Items given out for each worker, so that none waits for the next."""

DIED = "its process was killed, by the system for want of memory perhaps"


@dataclass(frozen=True, slots=True)
class Pool:
    """Where work is done.

    Attributes
    ----------
    opened : what opens it; after it broke, once more
    workers : how many there are

    """

    opened: Callable[[], contextlib.AbstractContextManager[Executor]]
    workers: int


def processes(count: int, preload: Sequence[str] = ()) -> Pool:
    """So many processes of this computer; `preload` modules are imported once."""
    method = "forkserver"
    if method not in multiprocessing.get_all_start_methods():
        method = "spawn"
    context = multiprocessing.get_context(method)
    if method == "forkserver":
        context.set_forkserver_preload(list(preload))
    return Pool(
        lambda: ProcessPoolExecutor(
            count, mp_context=context, initializer=_end_with_parent
        ),
        count,
    )


def _end_with_parent() -> None:
    """End this process when the one it works for has ended, however it did."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def scheduled(address: str) -> Iterator[Pool]:
    """Return the workers of a Dask scheduler that is running.

    Raises
    ------
    InputError
        If Dask is not installed, or no scheduler or no worker is there.

    """
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "--scheduler needs Dask: pip install 'fieldcal[fleet]'"
        ) from error
    engine: Any = distributed  # it states types of some functions only
    try:
        client = engine.Client(address, set_as_default=False, timeout="10s")
    except (OSError, ValueError) as error:
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
        yield Pool(client.get_executor, workers)


@dataclass(frozen=True, slots=True)
class Result(Generic[T]):
    """What became of an item: a value, or why there is none."""

    item: str
    value: T | None
    error: str = ""


def results(
    items: Sequence[str], work: Callable[[str], T], pool: Pool
) -> Iterator[Result[T]]:
    """Results as they come; each item has one, whatever happens to processes."""
    waiting, suspects = deque(items), deque[str]()
    while waiting or suspects:
        alone = bool(suspects)
        queue = suspects if alone else waiting
        running: dict[Future[T], str] = {}
        with pool.opened() as executor:
            try:
                while queue or running:
                    width = 1 if alone else AHEAD * pool.workers
                    while queue and len(running) < width:
                        running[executor.submit(work, queue[0])] = queue[0]
                        queue.popleft()
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        made = _result(running[future], future)
                        del running[future]
                        yield made
            except BrokenExecutor:
                if not alone:
                    suspects.extend(running.values())
                    continue
                yield from (Result(i, None, f"{i}: {DIED}") for i in running.values())


def _result(item: str, future: Future[T]) -> Result[T]:
    try:
        return Result(item, future.result())
    except BrokenExecutor:
        raise
    except Exception as error:  # of the engine: the work has caught its own
        return Result(item, None, f"{item}: {type(error).__name__}: {error}")
