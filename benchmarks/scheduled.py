"""What a second worker of Dask is worth, and what is lost when one is killed.

    python -m benchmarks scheduled 12       so many sessions of nine positions

Each number of workers has done a session each before the time is taken: what they
import then is imported once.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import distributed

from benchmarks.fleet import recorded
from fieldcal.fleet.outcome import SessionTask
from fieldcal.fleet.tree import sessions_in
from fieldcal.fleet.workers import dask_pool, run_tasks
from fieldcal.history.sessions import StoredSession


class Noted(SessionTask):
    """A task whose worker is killed once, amid a session."""

    def __call__(self, folder: str) -> StoredSession:
        """Carry it out, if the worker lives."""
        mark = Path(folder).parents[1] / "kill"
        if mark.exists():
            mark.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().__call__(folder)


def main() -> None:
    """Print what is measured."""
    engine: Any = distributed  # it states types of some functions only
    count = next((int(word) for word in sys.argv[1:] if word.isdigit()), 12)
    with TemporaryDirectory() as place:
        for i in range(count):
            recorded(Path(place) / "tree" / f"{i}", seed=i)
        folders = [str(one) for one in sessions_in([Path(place) / "tree"])]
        spent = {}
        for workers in (1, 2):
            with (
                engine.LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None
                ) as cluster,
                dask_pool(cluster.scheduler_address) as pool,
            ):
                list(run_tasks(folders[:workers], SessionTask(), pool))
                begun = perf_counter()
                done = list(run_tasks(folders, SessionTask(), pool))
                spent[workers] = perf_counter() - begun
                good = sum(
                    one.value is not None and bool(one.value.good) for one in done
                )
                print(
                    f"{workers} of Dask's workers: {count} sessions in"
                    f" {spent[workers]:.1f} s, {good} good"
                )
                if workers > 1:
                    (Path(place) / "kill").touch()
                    again = list(run_tasks(folders, Noted(), pool))
                    known = {one.item for one in again if one.value is not None}
                    print(
                        f"a worker killed: {len(known)} of {count} sessions with a"
                        f" result, {len(again) - len(known)} twice or without"
                    )
        print(f"two workers are {spent[1] / spent[2]:.2f} times as quick as one")
