"""`fieldcal serve`: receive sessions over HTTP and return their results."""

from __future__ import annotations

import argparse
import os
import sys
from contextlib import ExitStack
from pathlib import Path

from fieldcal.core.errors import InputError

RARE = (
    "history",
    "scheduler",
    "upload_mib",
    "jobs",
    "kept",
    "minutes",
    "memory_mib",
    "known_as",
)

EXAMPLE = """\
  fieldcal serve
  fieldcal serve --listen 192.168.1.5:8080 --tokens tokens.txt --folder all
  curl -H "Authorization: Bearer $TOKEN" --data-binary @unit-7.zip \\
    "http://127.0.0.1:8750/api/sessions?filename=unit-7.zip"
"""

LISTEN = "127.0.0.1:8750"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "--listen",
        default=LISTEN,
        metavar="HOST:PORT",
        help=f"address (default: {LISTEN}, this computer only)",
    )
    for option, kind, metavar, what in (
        ("--folder", Path, "FOLDER", "where sessions are kept (default: user's data)"),
        ("--tokens", Path, "FILE", "tokens of programs, one a line"),
        ("--history", str, "FILE", "instead of the usual store"),
        ("--scheduler", str, "tcp://HOST:PORT", "Dask's, which sees the same folder"),
    ):
        add(option, type=kind, metavar=metavar, help=what)
    add(
        "--known-as",
        action="append",
        default=[],
        metavar="HOST:PORT",
        help="host name that a proxy forwards; may be given several times",
    )
    for option, default, what in (
        ("--upload-mib", 256, "largest recording, MiB"),
        ("--jobs", 32, "recordings that may wait"),
        ("--kept", 1000, "sessions that are kept; the oldest go first"),
        ("--minutes", 30, "processor time of one session, min"),
        ("--memory-mib", 4096, "memory of one session, MiB"),
    ):
        add(option, type=int, default=default, metavar="N", help=f"{what} ({default})")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    try:
        from fieldcal.service.server import Service, read_tokens
    except ImportError as error:
        raise InputError(
            "the service needs starlette and uvicorn: pip install 'fieldcal[page]'"
        ) from error
    from fieldcal.commands.run_page import parse_address
    from fieldcal.fleet.workers import dask_pool, process_pool
    from fieldcal.history.database import Database
    from fieldcal.history.location import default_location
    from fieldcal.service.bounds import MIB, ServiceBounds
    from fieldcal.service.jobs import JobStore, held_folder
    from fieldcal.service.queue import JobQueue

    few = ("upload_mib", "jobs", "kept", "minutes", "memory_mib")
    if wrong := next((n for n in few if getattr(args, n) < 1), None):
        raise InputError(f"--{wrong.replace('_', '-')}: one at least is wanted")
    bounds = ServiceBounds(
        upload=args.upload_mib * MIB, unpacked=8 * args.upload_mib * MIB,
        jobs=args.jobs, kept=args.kept, seconds=60 * args.minutes,
        memory=args.memory_mib * MIB,
    )  # fmt: skip
    tokens = read_tokens(args.tokens) if args.tokens else []
    host, port = parse_address(args.listen, "--listen")
    with ExitStack() as open_:
        if args.scheduler:
            pool = open_.enter_context(dask_pool(args.scheduler))
        else:
            pool = process_pool(1, ["fieldcal.service.work"])
        folder = (args.folder or _default_folder()).resolve()
        open_.enter_context(held_folder(folder))
        jobs = JobStore(folder, bounds)
        database = Database(args.history or default_location())
        queue = JobQueue(jobs, database, pool)
        service = Service.listen(host, port, jobs, queue, tokens, args.known_as)
        open_.enter_context(queue)
        sys.stderr.write(f"page: {service.address}\n")
        sys.stderr.write(f"sessions: {jobs.root}\nstore: {database.location_text}\n")
        sys.stderr.flush()
        service.serve()
    return 0


def _default_folder() -> Path:
    data = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(data) / "fieldcal" / "served"
