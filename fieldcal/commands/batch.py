"""`fieldcal batch`: solve, judge and diagnose whole trees of sessions."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.fleet.batch import SessionBatch
    from fieldcal.fleet.workers import WorkerPool
    from fieldcal.history.sessions import StoredSession

RARE = ("scheduler", "history", "limits")

EXAMPLE = """\
  fieldcal batch sessions/2026-03
  fieldcal batch archive --diagnose --resume
  fieldcal batch archive --jobs 8 -o march.parquet
  fieldcal batch /net/archive --scheduler tcp://10.0.0.5:8786
"""

DEFAULT_TABLE = "batch.parquet"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("folders", type=Path, nargs="+", metavar="FOLDER", help="trees of sessions")
    add("--jobs", type=int, metavar="N", help="processes (default: one a core)")
    add(
        "--resume",
        action="store_true",
        help="skip sessions that are done and unchanged",
    )
    add("--diagnose", action="store_true", help="also diagnose each session")
    add(
        "-o",
        "--output",
        type=Path,
        default=Path(DEFAULT_TABLE),
        metavar="FILE",
        help=f"table of the results (default: {DEFAULT_TABLE})",
    )
    add("--json", action="store_true", help="print one JSON object")
    add("--limits", type=Path, metavar="FILE", help="limits for GO and NO-GO of each")
    add(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="Dask scheduler; its workers see the same folders (fieldcal[fleet])",
    )
    add("--history", metavar="FILE", help="use this store")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 0 if all are good, 1 if some are not or have no result."""
    from fieldcal.calibration.limits import check_every_grade
    from fieldcal.commands.progress import process_with_progress
    from fieldcal.fleet.batch import SessionBatch
    from fieldcal.fleet.outcome import SessionTask
    from fieldcal.fleet.tree import sessions_in
    from fieldcal.history.database import Database
    from fieldcal.history.location import default_location
    from fieldcal.history.repeats import copy_sentence
    from fieldcal.session.file_writing import check_writable

    check_writable(args.output)
    if args.limits:
        check_every_grade(args.limits)
    limits = str(args.limits.resolve()) if args.limits else None
    batch = SessionBatch(
        sessions_in(args.folders),
        SessionTask(args.diagnose, limits),
        Database(args.history or default_location()),
    )
    every = [str(folder) for folder in batch.folders]
    left = batch.unprocessed() if args.resume else every
    try:
        if left:
            with worker_pool(args) as pool:
                process_with_progress(batch, left, pool)
    except (KeyboardInterrupt, InputError):  # as of a store that is gone for good
        sys.stderr.write(
            "fieldcal batch: what was finished is stored; the same command with"
            " --resume goes on with the others\n"
        )
        raise
    batch.write(args.output)
    for pair in batch.shorter_copies():
        sys.stderr.write(f"fieldcal batch: {copy_sentence(*pair)}\n")
    return _print_summary(args, batch, len(left))


@contextlib.contextmanager
def worker_pool(args: argparse.Namespace) -> Iterator[WorkerPool]:
    """Yield a pool of --jobs processes, or of the workers of --scheduler.

    Raises
    ------
    InputError
        If there would be no process.

    """
    from fieldcal.fleet.workers import dask_pool, process_pool

    if args.jobs is not None and args.jobs < 1:
        raise InputError(f"--jobs {args.jobs}: there must be one process at least")
    if getattr(args, "scheduler", None):
        with dask_pool(args.scheduler) as pool:
            yield pool
    else:
        yield process_pool(args.jobs or os.cpu_count() or 1, ["fieldcal.fleet.outcome"])


def _print_summary(args: argparse.Namespace, batch: SessionBatch, done: int) -> int:
    rows = [one for some in batch.stored_rows() for one in some]
    failed = [one for one in rows if one.error]
    solved = [one for one in rows if not one.error]
    bad = sum(not one.good for one in solved)
    go = sum(one.go is True for one in solved)
    judged = sum(one.go is not None for one in solved)
    if args.json:
        _print_json(args, rows, done)
    else:
        say = sys.stdout.write
        some = f"{len(rows)} session{'s' * (len(rows) != 1)}"
        say(f"{some}, {done} of them done now: {len(solved)} solved")
        say(f", {go} of {judged} GO" if judged else ", none to be judged")
        say(f", {bad} not good, {len(failed)} without a result")
        say(" (the column error says why)\n" if failed else "\n")
        say(f"written: {args.output}\nstore: {batch.database.location_text}\n")
    return 1 if bad or go < judged or failed else 0


def _print_json(args: argparse.Namespace, rows: list[StoredSession], done: int) -> None:
    listed = [
        {"folder": r.folder, "go": r.go, "good": r.good, "error": r.error} for r in rows
    ]
    document = {"sessions": listed, "done": done, "table": str(args.output)}
    sys.stdout.write(json.dumps(document) + "\n")
