"""`fieldcal run`: recalibrate a device, at the console or headless."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.find_device import find_device
from fieldcal.commands.repeated_option import StoreRepeated
from fieldcal.commands.run_page import LOCAL, serve_page, show_end_on_page
from fieldcal.commands.run_recording import record_and_solve
from fieldcal.commands.run_results import (
    report_broken_run,
    tell_calculation,
    write_junit,
)
from fieldcal.commands.run_statements import decide_as_stated, write_statements
from fieldcal.commands.run_task import SESSIONS, make_task, session_to_resume
from fieldcal.commands.run_timeouts import (
    HEADLESS_PATIENCE_S,
    OPERATOR_PATIENCE_S,
)
from fieldcal.commands.site import add_site_options
from fieldcal.core.errors import FieldcalError
from fieldcal.core.factory import FACTORY_KEYS
from fieldcal.core.plugins import module_names

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.history.location import StoreLocation
    from fieldcal.run.page.server import PageServer
    from fieldcal.run.plan_file import PlanTask

EXAMPLE = """\
  fieldcal run adaptive --latitude 50.45 --angles 0.01
  fieldcal run five_position --device "serial:/dev/ttyUSB0?format=witmotion"
  fieldcal run five_position --virtual --speed 20
  fieldcal run plan.toml --headless --json --junit run.xml > result.json
  fieldcal run --resume sessions/2026-03-01T09-30-00-five_position
"""

RARE = (
    *("seed", "patience", "sigma", "history", "limits", "junit", "no_report"),
    *("name", "lot", "station", "operator", "grade", "gravity", "angles_from"),
    "keeps_gyro_bias",
    *FACTORY_KEYS,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    # names only, since importing the procedures would slow down the help
    procedures = module_names([str(Path(__file__).parents[1] / "procedures")])
    add(
        "procedure",
        nargs=argparse.OPTIONAL,
        metavar="PROCEDURE",
        help=f"{', '.join(procedures)}, or a plan file (a session.toml with"
        " positions, and a table [run])",
    )
    add(
        "--resume",
        type=Path,
        nargs=argparse.OPTIONAL,
        const=SESSIONS,
        metavar="SESSION",
        help="continue an interrupted run (default: the last)",
    )
    _add_device_options(parser)
    _add_task_options(parser)
    add("-o", "--output", type=Path, metavar="FOLDER", help="where to record")
    add(
        "--headless",
        action="store_true",
        help="without operator; progress as JSON lines",
    )
    add(
        "--page",
        nargs=argparse.OPTIONAL,
        const=LOCAL,
        metavar="HOST:PORT",
        help="serve a page for phone and tablet on the local network",
    )
    add("--plain", action="store_true", help="print lines instead of a screen")
    add("--json", action="store_true", help="print the result as one JSON object")
    add("--no-report", action="store_true", help="write no report.html")
    add("--junit", type=Path, metavar="FILE", help="write the outcome as JUnit XML")
    add_site_options(parser, several=True)


def _add_device_options(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "--device",
        action=StoreRepeated,
        metavar="URL",
        help='such as "serial:/dev/ttyUSB0?format=witmotion"; repeat it for each'
        " further device that turns with the first",
    )
    parser.set_defaults(further_device=[], further_serial=[], records=False)
    add(
        "--virtual",
        nargs=argparse.OPTIONAL,
        const="",
        metavar="OPTIONS",
        help="use a virtual device; OPTIONS of fieldcal sim in one string",
    )
    add("--speed", default="1", metavar="X", help="speed of the virtual device's time")
    add("--seed", default="1", metavar="N", help="seed of the virtual device's noise")
    add(
        "--patience",
        type=float,
        metavar="S",
        help="how long to wait for a device that disconnected"
        f" (default: {OPERATOR_PATIENCE_S:g}, headless {HEADLESS_PATIENCE_S:g})",
    )


def _add_task_options(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--seconds", type=float, metavar="S", help="averaging time (default: 30)")
    add("--sigma", type=float, metavar="M/S^2", help="stop averaging at this ± instead")
    add(
        "--level",
        type=float,
        metavar="DEG",
        help="uncertainty of the level base, 1σ about each axis; two_position needs it",
    )
    add(
        "--angles",
        type=float,
        metavar="DEG",
        help="how well each position's angles are set, 1σ (default: the grade's limit)",
    )
    add(
        "--angles-from",
        metavar="TEXT",
        help="source of --angles, such as the certificate of the fixture",
    )
    add(
        "--sways",
        action="store_true",
        default=None,
        help="the base sways: do not wait until it comes to rest",
    )
    add(
        "--verify",
        action="store_true",
        help="add a position that is not fitted, as a check",
    )
    add("--limits", type=Path, metavar="FILE", help="limits for GO and NO-GO")
    add("--history", metavar="FILE", help="use this history")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; with --headless all of standard error is events."""
    if not args.headless:
        return _prepare_and_run(args)
    from fieldcal.run.operator.event_lines import lines_as_events
    from fieldcal.run.operator.script import report_event

    with lines_as_events():
        code = _prepare_and_run(args)
    report_event("end", exit_code=code, error=None)
    return code


def tell_failure(arguments: Sequence[str], said: str, code: int) -> bool:
    """Tell the error that ended a run as its last event; False without --headless."""
    from fieldcal.run.operator.script import report_event

    if "--headless" not in arguments:
        return False
    report_event("end", exit_code=code, error=said)
    return True


def _prepare_and_run(args: argparse.Namespace) -> int:
    from fieldcal.session.lock import refuse_in_use

    if args.resume:
        folder = session_to_resume(args.resume)
        if write_statements(args, folder):
            code = decide_as_stated(args, folder)
            if code is not None:
                return code
    task, folder = make_task(args)
    if not task.run.get("device") and task.mover["kind"] != "virtual":
        refuse_in_use(folder)
        find_device(args, _plan_states_mounting(args, task))
        task, folder = make_task(args)
    with serve_page(args) as page:
        return _run_and_show(page, args, task, folder)


def _plan_states_mounting(args: argparse.Namespace, task: PlanTask) -> bool:
    from fieldcal import procedures

    of_plan = args.procedure not in procedures.procedure_names()
    return of_plan and "mounting" in task.tables.get("frame", {})


def _run_and_show(
    page: PageServer | None, args: argparse.Namespace, task: PlanTask, folder: Path
) -> int:
    from fieldcal.calibration import limits
    from fieldcal.commands import run_view
    from fieldcal.commands.progress import SEARCH, show_work
    from fieldcal.commands.run_results import (
        check_companions,
        first_result,
        further_results,
    )
    from fieldcal.history.location import default_location
    from fieldcal.history.store import History

    file = args.limits or task.run.get("limits")
    bounds = limits.read(task.about.grade, Path(file) if file else None)
    history = History(args.history or default_location())
    try:
        found, truth, others = record_and_solve(args, task, folder, bounds, page)
        tell_calculation(args)
        with show_work(args, f"{SEARCH} {folder}"):
            found = first_result(found, folder, bounds, history)
    except (FieldcalError, KeyboardInterrupt) as error:
        show_end_on_page(page, (), error)
        report_broken_run(args, task, folder, error)
        raise
    if args.junit:
        write_junit(args.junit, task, folder, found.to_json())
    with show_work(args, f"{SEARCH} the recordings of the further devices"):
        further = further_results(others, bounds, history)
    show_end_on_page(page, (found, *further.values()))
    _show_results(args, folder, (found, truth, further), history.place)
    try:
        check_companions(others)
    except FieldcalError as error:
        error.printed = bool(args.json)
        raise
    return 0 if all(map(run_view.is_go, (found, *further.values()))) else 1


def _show_results(
    args: argparse.Namespace,
    folder: Path,
    results: tuple[Calibration, dict[str, Any] | None, dict[str, Calibration]],
    history: StoreLocation,
) -> None:
    """Print and report the result, the truth if known, and the further devices'."""
    from fieldcal.commands import run_view

    found, truth, further = results
    if args.json:
        run_view.show_json(found, truth, further)
    else:
        run_view.show_results(found, folder, truth, further)
    if not args.no_report:
        for each in (folder, *(folder / name for name in further)):
            report = run_view.try_write_report(each, history)
            if report and not args.json:
                sys.stdout.write(f"report:   {report}\n")
    if not args.json:
        run_view.show_decisions(found, further, folder)
