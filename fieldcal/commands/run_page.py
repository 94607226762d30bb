"""Serves the page of a run for phone and tablet, and shows the result on it."""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError, Stopped

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.run.operator.protocol import Operator
    from fieldcal.run.page.server import PageServer
    from fieldcal.run.plan_file import PlanTask

LOCAL = "local"
"""Placeholder for this computer's address on the local network."""

SCAN_WAIT_S = 60.0
"""How long the run waits for the code on the console to be scanned, s."""

QUIET_ZONES = (4, 2, 1)
"""Light modules around a code, the first that fits the terminal."""

TOO_SMALL = "a code to scan does not fit this terminal: 38 by 20 characters are needed"
"""What is shown in place of the code."""


@contextlib.contextmanager
def serve_page(args: argparse.Namespace) -> Iterator[PageServer | None]:
    """Serve the page if --page is given, and show its address.

    Raises
    ------
    InputError
        If the page cannot be served.

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
    host, port = parse_address(args.page)
    with PageServer(local_address() if host == LOCAL else host, port) as server:
        _announce_page(server, args)
        yield server


def parse_address(text: str, option: str = "--page") -> tuple[str, int]:
    """Host and port of an option's value; port 0 if it has none.

    >>> [parse_address(at) for at in ("local", "192.168.1.5:8080", "[::1]:8080")]
    [('local', 0), ('192.168.1.5', 8080), ('::1', 8080)]
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


def _announce_page(server: PageServer, args: argparse.Namespace) -> None:
    """Show the address, and on a terminal a code to scan."""
    if args.headless:
        from fieldcal.run.operator.script import report_event

        report_event("page", address=server.address)
        return
    sys.stderr.write(f"page: {server.address}\n")
    if args.plain or not sys.stderr.isatty():
        return
    from fieldcal.commands.console import EscapingConsole

    size = EscapingConsole(stderr=True).size
    code = code_to_scan(server.address, size.width, size.height)
    sys.stderr.write(code or f"{TOO_SMALL}\n")
    what = "scan it" if code else "open the address"
    sys.stderr.write(f"{what}, or press Enter to go on without\n")
    sys.stderr.flush()
    wait_for_page(server)


def code_to_scan(address: str, columns: int, lines: int) -> str:
    """QR code of an address, and below it room for a line; empty if it does not fit.

    The quiet zone that the standard wants has four modules; on a small terminal fewer.
    """
    import segno

    made = segno.make(address, error="l")
    for border in QUIET_ZONES:
        drawn = io.StringIO()
        made.terminal(drawn, border=border, compact=True)
        width, _ = made.symbol_size(border=border)
        if width <= columns and drawn.getvalue().count("\n") + 2 <= lines:
            return drawn.getvalue()
    return ""


def wait_for_page(server: PageServer) -> None:
    """Wait until the page is opened, a key is pressed, or the time is over."""
    from time import monotonic, sleep

    from fieldcal.run.operator.keyboard import Keyboard

    until = monotonic() + SCAN_WAIT_S
    with Keyboard() as keyboard:
        while keyboard.has_keys and not server.watched and monotonic() < until:
            pressed = keyboard.pressed()
            if pressed == "stop":
                raise Stopped("stopped by the operator")
            if pressed == "confirm":
                return
            sleep(0.05)


def show_on_page(
    operator: Operator,
    server: PageServer | None,
    task: PlanTask,
    title: str,
    most: int | None,
) -> Operator:
    """The operator, who is shown on the page as well if there is one."""
    if server is None:
        return operator
    from fieldcal.run.page.board import Board
    from fieldcal.run.page.page_operator import PageOperator

    positions = task.about.positions if most else task.positions
    server.board = Board(title, positions, most)
    return PageOperator(operator, server.board, server.buttons)


def show_end_on_page(
    server: PageServer | None,
    results: Sequence[Calibration],
    broken: BaseException | None = None,
) -> None:
    """Show GO, NO-GO with its reasons, or why the run stopped, on the page."""
    if server is None:
        return
    if broken is not None:
        server.board.run_ended("STOPPED", [str(broken) or "interrupted"], False)
        return
    from fieldcal.commands.run_view import is_go

    good = all(map(is_go, results))
    said = [s for found in results for s in _decision_sentences(found)]
    server.board.run_ended("GO" if good else "NO-GO", said, good)


def _decision_sentences(found: Calibration) -> list[str]:
    """Reasons of a NO-GO, and its remedy."""
    decision = found.info.get("decision", {})
    said = [str(c["says"]) for c in decision.get("checks", ()) if c["ok"] is False]
    remedy = decision.get("remedy")
    return [*said, *([str(remedy["says"])] if remedy else [])]
