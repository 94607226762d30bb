"""`fieldcal report`: a session as one page that opens offline."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

EXAMPLE = """\
  fieldcal report bench-7/2026-03-01
  fieldcal report bench-7/2026-03-01 --earlier bench-7/2026-02-01 --pdf
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder")
    add(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="where to write the page (default: report.html in the session)",
    )
    add(
        "--earlier",
        type=Path,
        nargs="+",
        default=[],
        metavar="RESULT",
        help="earlier sessions or result.json of the same device, oldest first",
    )
    add("--pdf", action="store_true", help="beside it a .pdf, by Chromium")
    add("--png", action="store_true", help="beside it a .png, by Chromium")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    page = write(args.session, args.output, args.earlier)
    sys.stdout.write(f"written: {page}\n")
    if args.pdf or args.png:
        from fieldcal.report.browser import Browser

        with Browser() as browser:
            browser.open(page)
            for wanted, ending, make in (
                (args.pdf, ".pdf", browser.pdf),
                (args.png, ".png", browser.png),
            ):
                if wanted:
                    path = page.with_suffix(ending)
                    path.write_bytes(make())
                    sys.stdout.write(f"written: {path}\n")
    return 0


def write(
    session: Path, output: Path | None = None, earlier: Sequence[Path] = ()
) -> Path:
    """Write the report of a session and return where it is.

    Raises
    ------
    SessionError
        If the session cannot be read, or the page not be written.

    """
    from fieldcal.report import gather, render
    from fieldcal.report.gather import earlier_result
    from fieldcal.report.page import REPORT
    from fieldcal.session import write_whole

    material = gather(session, [earlier_result(path) for path in earlier])
    return write_whole(output or session / REPORT, render(material))
