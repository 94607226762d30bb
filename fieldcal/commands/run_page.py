"""The page of a run for phone and tablet: where it is served, and how it ends."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.run.operator.protocol import Operator
    from fieldcal.run.page.server import PageServer
    from fieldcal.run.plan_file import PlanTask

LOCAL = "local"
"""What stands for this computer's address on the local network."""

SCANNED = 60.0
"""How long the code on the console is shown before the run goes on, s."""


@contextlib.contextmanager
def served(args: argparse.Namespace) -> Iterator[PageServer | None]:
    """Serve the page if it is asked for, and show where it is.

    Raises
    ------
    InputError
        If it cannot be served.

    """
    if args.page is None:
        yield None
        return
    try:
        from fieldcal.run.page.server import PageServer, local_address
    except ImportError as error:
        raise InputError(
            "the page needs starlette, uvicorn and segno: pip install 'fieldcal[page]'"
        ) from error
    host, port = address_of(args.page)
    with PageServer(local_address() if host == LOCAL else host, port) as server:
        _announce(server, args)
        yield server


def address_of(text: str, option: str = "--page") -> tuple[str, int]:
    """Host and port of what an option says.

    >>> address_of("local"), address_of("192.168.1.5:8080"), address_of("[::1]:8080")
    (('local', 0), ('192.168.1.5', 8080), ('::1', 8080))
    """
    host, colon, port = text.rpartition(":")
    if not colon or text.endswith("]"):
        host, port = text, "0"
    host = host.removeprefix("[").removesuffix("]")
    if not host or not port.isdecimal() or int(port) > 65535:
        raise InputError(
            f"{option} {text}: give an address of this computer, with a port if you"
            " like, as in 192.168.1.5:8080"
        )
    return host, int(port)


def _announce(server: PageServer, args: argparse.Namespace) -> None:
    """Show the address, and a code to scan where there is a terminal."""
    if args.headless:
        from fieldcal.run.operator.script import report_event

        report_event("page", address=server.address)
        return
    sys.stderr.write(f"page: {server.address}\n")
    if args.plain or not sys.stderr.isatty():
        return
    import segno

    segno.make(server.address, error="l").terminal(sys.stderr, compact=True)
    sys.stderr.write("scan it, or press Enter to go on without\n")
    sys.stderr.flush()
    _until_scanned(server)


def _until_scanned(server: PageServer) -> None:
    """Wait until the page was opened, or somebody goes on without."""
    from time import monotonic, sleep

    from fieldcal.run.operator.keyboard import Keyboard

    until = monotonic() + SCANNED
    with Keyboard() as keyboard:
        while keyboard.has_keys and not server.watched and monotonic() < until:
            if keyboard.pressed() == "confirm":
                return
            sleep(0.05)


def watched(
    operator: Operator,
    server: PageServer | None,
    task: PlanTask,
    title: str,
    most: int | None,
) -> Operator:
    """The operator, whose run is seen on the page as well where there is one."""
    if server is None:
        return operator
    from fieldcal.run.page.board import Board
    from fieldcal.run.page.watched import WatchedOperator

    positions = task.about.positions if most else task.positions
    server.board = Board(title, positions, most)
    return WatchedOperator(operator, server.board, server.buttons)


def told_end(
    server: PageServer | None,
    results: Sequence[Calibration],
    broken: BaseException | None = None,
) -> None:
    """Tell the page GO, NO-GO with its reasons, or why the run stopped."""
    if server is None:
        return
    if broken is not None:
        server.board.run_ended("STOPPED", [str(broken) or "interrupted"], False)
        return
    from fieldcal.commands.run_view import is_go

    good = all(map(is_go, results))
    said = [s for found in results for s in _reasons(found)]
    server.board.run_ended("GO" if good else "NO-GO", said, good)


def _reasons(found: Calibration) -> list[str]:
    """Why it is NO-GO and what to do, or what GO relies on."""
    decision = found.info.get("decision", {})
    said = [str(c["says"]) for c in decision.get("checks", ()) if c["ok"] is False]
    remedy = decision.get("remedy")
    return [*said, *([str(remedy["says"])] if remedy else [])]
