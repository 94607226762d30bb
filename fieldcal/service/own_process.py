"""Carries out a job in a process of its own, for a caller that works in threads.

A worker of Dask does. Limits of processor time and memory hold for a whole process, and
only its main thread can end a job at a limit. A worker that is killed for one job would
lose its other jobs as well, and Dask would try that job again. The process ends when
its caller does.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

from fieldcal.history.sessions import StoredSession


def run_in_own_process(
    task: Callable[[str], StoredSession], folder: str
) -> StoredSession:
    """Result of a task for a folder; ``error`` states if its process was killed."""
    call = [sys.executable, "-m", __name__]
    pipe = subprocess.PIPE
    with subprocess.Popen(call, stdin=pipe, stdout=pipe) as process:
        if process.stdin is None or process.stdout is None:
            raise RuntimeError("the process has no pipes")
        with suppress(BrokenPipeError):
            pickle.dump((task, folder), process.stdin)
            process.stdin.flush()
        made = process.stdout.read()
        process.wait()  # before its input is closed, which would end it
    if process.returncode:
        from fieldcal.fleet.workers import DIED

        return StoredSession(folder, error=DIED)
    found: StoredSession = pickle.loads(made)
    return found


def _end_with_caller() -> None:
    """End this process when the caller has closed the pipe, or has ended."""

    def watch() -> None:
        os.read(0, 1)  # a buffered stream would be locked at the end of the process
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def main() -> None:
    """Read a task and a folder, and write the result."""
    result = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what is printed is no part of the result
    task, folder = pickle.load(sys.stdin.buffer)
    _end_with_caller()
    with result:
        pickle.dump(task(folder), result)


if __name__ == "__main__":
    main()
