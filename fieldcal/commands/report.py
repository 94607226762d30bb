"""`fieldcal report`: write the report of a session, one HTML file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fieldcal.history.location import StoreLocation
    from fieldcal.report import EarlierCalibration

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
        help="earlier sessions or result.json of the same device, oldest first"
        " (default: from its history)",
    )
    add("--pdf", action="store_true", help="also write a .pdf, by Chromium")
    add("--png", action="store_true", help="also write a .png, by Chromium")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    page = write_report(args.session, args.output, args.earlier)
    sys.stdout.write(f"written: {page}\n")
    if args.pdf or args.png:
        from fieldcal.report.browser import Browser
        from fieldcal.session.file_writing import write_atomically

        with Browser() as browser:
            browser.open(page)
            for wanted, ending, make in (
                (args.pdf, ".pdf", browser.pdf),
                (args.png, ".png", browser.png),
            ):
                if wanted:
                    path = page.with_suffix(ending)
                    write_atomically(path, make())
                    sys.stdout.write(f"written: {path}\n")
    return 0


def write_report(
    session: Path,
    output: Path | None = None,
    earlier: Sequence[Path] = (),
    history: StoreLocation | None = None,
) -> Path:
    """Write the report of a session; returns its path.

    Parameters
    ----------
    session : its folder
    output : the page; in the session's folder if not given
    earlier : results to compare with; those of the device's history if none are given
    history : another store than the user's

    Raises
    ------
    SessionError
        If the session cannot be read, or the page not be written.

    """
    from fieldcal.report import gather, render
    from fieldcal.report.gather import read_earlier_result
    from fieldcal.report.page import REPORT
    from fieldcal.session.file_writing import write_atomically

    before = [read_earlier_result(path) for path in earlier] or _earlier_calibrations(
        session, history
    )
    return write_atomically(output or session / REPORT, render(gather(session, before)))


def _earlier_calibrations(
    folder: Path, history: StoreLocation | None
) -> list[EarlierCalibration]:
    """Calibrations of the device in the history that are earlier than this session.

    A history that cannot be read is said, and none are taken: the session is as good.
    """
    from fieldcal.acceptance.assessment import start_time
    from fieldcal.core.errors import InputError
    from fieldcal.history.location import default_location
    from fieldcal.history.store import History, earlier_runs
    from fieldcal.report import EarlierCalibration
    from fieldcal.session.folder import Session
    from fieldcal.session.recorded_part import recorded_part

    session = Session.open(folder)
    serial = session.about.device.get("serial")
    if not serial:
        return []
    try:
        runs = History(history or default_location()).runs(str(serial))
    except InputError as error:
        sys.stderr.write(f"fieldcal: report without earlier calibrations: {error}\n")
        return []
    taken_at, part = start_time(list(session.marks())), recorded_part(folder)
    before = earlier_runs(runs, folder, taken_at, part)
    return [EarlierCalibration(run.taken_at[:10], run.calibration) for run in before]
