"""Results of a run: each device is solved, decided about, stored and written."""

from __future__ import annotations

import argparse
import contextlib
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import DeviceError, FieldcalError, SessionError

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.calibration.limits import GradeLimits
    from fieldcal.history.store import History
    from fieldcal.run.companions import Companion
    from fieldcal.run.plan_file import PlanTask
    from fieldcal.session.folder import Session

CALCULATION = (
    "the recording is complete, the device may be moved\ncalculating GO or NO-GO ..."
)
"""What is said until there is a result, which takes seconds."""

UNTAKEN = "no position was taken, so the same command may begin again; "
"""What is said behind a run that broke off before it had anything to keep."""


def tell_calculation(args: argparse.Namespace) -> None:
    """Say that the recording is over, and what the wait is for, to a person."""
    if not args.headless:
        sys.stderr.write(f"{CALCULATION}\n")
        sys.stderr.flush()


def solve_and_decide(
    session: Session, bounds: GradeLimits, history: History, method: str = "auto"
) -> Calibration:
    """Solve a session, decide, write result.json and store it in the history.

    Parameters
    ----------
    session : the recording
    bounds : limits of the device's grade
    history : stores the result if the device has a serial number
    method : of the procedure

    """
    from fieldcal.acceptance.assessment import assess, store_in_history
    from fieldcal.commands.install_values import add_install_values
    from fieldcal.evaluation.repaired_session import repaired_session, with_repairs
    from fieldcal.evaluation.solution import solve_session
    from fieldcal.evaluation.usable_windows import usable_windows
    from fieldcal.session.folder import RESULT
    from fieldcal.session.result_source import with_source

    session, repaired = repaired_session(session)
    still = usable_windows(session)
    found = with_repairs(solve_session(session, still, method=method), repaired)
    found = add_install_values(found, session)
    found = assess(found, session, still, bounds, history)
    found = with_source(found, session.folder)
    session.write_json(RESULT, found.to_json())
    if said := store_in_history(history, session, found):
        sys.stderr.write(f"fieldcal run: {said}\n")
    return found


def first_result(
    found: Calibration, folder: Path, bounds: GradeLimits, history: History
) -> Calibration:
    """Result of the first device, which the procedure was carried out on.

    The method is that of the procedure, or "auto" if positions were added.
    """
    from fieldcal.session.folder import Session
    from fieldcal.session.marks import POSITION_ADDED

    session = Session.open(folder)
    more = any(mark.get("event") == POSITION_ADDED for mark in session.marks())
    return solve_and_decide(session, bounds, history, "auto" if more else found.method)


def further_results(
    others: Sequence[Companion], bounds: GradeLimits, history: History
) -> dict[str, Calibration]:
    """Results of the further devices that were recorded to the end, by folder."""
    from fieldcal.session.folder import Session

    found = {}
    for other in others:
        if other.failed is None:
            try:
                session = Session.open(other.folder)
                found[other.folder.name] = solve_and_decide(session, bounds, history)
            except FieldcalError as fault:
                other.failed = fault
    return found


def check_companions(others: Sequence[Companion]) -> None:
    """Raise an error if one of the further devices failed.

    Raises
    ------
    DeviceError
        Naming the first of them.

    """
    for other in others:
        if other.failed is not None:
            raise DeviceError(
                f"{other.folder.name}: {other.failed}; the other devices have their"
                " results"
            )


def write_junit(
    path: Path, task: PlanTask, folder: Path, result: Any, said: str = ""
) -> None:
    """Write the outcome as JUnit XML; `result` is None if the run broke off."""
    from fieldcal.acceptance.verification import planned_verification
    from fieldcal.run import junit
    from fieldcal.session.description_file import with_added_positions
    from fieldcal.session.marks import MARKS, POSITION_ADDED, read_marks
    from fieldcal.session.position_tables import parse_positions

    marks = list(read_marks(folder / MARKS))
    about = task.about
    more = [m for m in marks if m.get("event") == POSITION_ADDED]
    more = [m for m in more if int(m["position"]) >= len(about.positions)]
    about = with_added_positions(about, parse_positions(more)[0])
    positions = [*about.positions, *filter(None, [planned_verification(about)])]
    junit.write(path, task.procedure, positions, marks, result, said)


def report_broken_run(
    args: argparse.Namespace, task: PlanTask, folder: Path, error: BaseException
) -> None:
    """Report what is kept of a run that broke off, and how to resume it.

    A folder of another run is not touched.
    """
    from fieldcal.run.begun_before import has_taken_position
    from fieldcal.session.marks import MARKS

    own = args.resume or args.records
    if isinstance(error, SessionError) and not args.records:
        return  # it says what is wrong with the folder, or who records there
    if not own or not os.path.exists(folder / MARKS):  # False where nobody may look
        return
    if args.junit:
        write_junit(args.junit, task, folder, None, str(error) or "interrupted")
    if args.resume or not _discard_if_empty(folder, len(task.further)):
        moved = ", with --device if its port is another now (fieldcal ports)"
        begin = "" if has_taken_position(folder) else UNTAKEN
        sys.stderr.write(
            f"what was recorded is kept in {folder}; {begin}to go on:"
            f" fieldcal run --resume {shlex.quote(str(folder))}"
            f"{moved if isinstance(error, DeviceError) else ''}\n"
        )


def _discard_if_empty(folder: Path, further: int) -> bool:
    """Remove a session without samples; returns whether it was removed.

    Its folder would block the next attempt, and so would those of the further devices,
    which have no window without the first one.
    """
    from fieldcal.run.companions import companion_folders
    from fieldcal.session.arrow_stream import decode_stream
    from fieldcal.session.folder import DESCRIPTION
    from fieldcal.session.marks import MARKS
    from fieldcal.session.recorder import SAMPLES

    with contextlib.suppress(OSError):
        if decode_stream((folder / SAMPLES).read_bytes()).end:
            return False
        for each in (*companion_folders(folder, further), folder):
            for name in (SAMPLES, MARKS, DESCRIPTION):
                (each / name).unlink(missing_ok=True)
            with contextlib.suppress(OSError):
                each.rmdir()  # whatever else is there stays
        return True
    return False
