"""`fieldcal solve`: estimate a calibration from a recorded session."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.keep_result import keep_result
from fieldcal.commands.site import add_factory_options
from fieldcal.core.errors import InputError
from fieldcal.core.factory import FACTORY_KEYS

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.calibration.lot_prior import LotPrior
    from fieldcal.evaluation.usable_windows import UsableWindows
    from fieldcal.session.folder import Session

RARE = ("as_printed", "method", "heading", "history", "lot")

EXAMPLE = """\
  fieldcal solve bench-7/2026-03-01
  fieldcal solve bench-7/2026-03-01 --over-time
  fieldcal solve imu0 --cross --json > imu0.json
  fieldcal solve unit-81 --lot lot=2026-11
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder")
    add("--json", action="store_true", help="print result.json instead of the table")
    add(
        "--method",
        default="auto",
        choices=("auto", "two_position", "five_position", "joint", "scalar"),
        help="auto (default): the best that the positions allow",
    )
    add(
        "--tilt",
        default="auto",
        choices=("auto", "none", "angle_offset", "base_tilt"),
        help="model of a base that is not level; auto (default): chosen from the data",
    )
    add("--cross", action="store_true", help="also estimate cross-coupling")
    add(
        "--turns",
        default="auto",
        choices=("auto", "yes", "no"),
        help="estimate scale factor and cross-coupling of the gyroscopes from the turns"
        " between the windows; auto (default): if the turns determine them",
    )
    for option, what in (
        ("--level", "uncertainty of the level base, 1σ about each axis"),
        ("--angles", "how well each position's angles were set, 1σ; else the grade's"),
        ("--heading", "how well z points north, 1σ; for the gyroscopes"),
    ):
        add(option, type=float, metavar="DEG", help=what)
    add_factory_options(parser)
    add(
        "--lot",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="use these units of the store as prior knowledge; conditions as in"
        " fieldcal lot; may be given several times",
    )
    add(
        "--over-time",
        action="store_true",
        help="also how each parameter depends on the averaging time, and what wins over"
        " noise from when",
    )
    add("--limits", type=Path, metavar="FILE", help="limits for GO and NO-GO")
    add("--history", metavar="FILE", help="use this history")
    add(
        "--as-printed",
        action="store_true",
        help="use the equations of the paper with their misprints, for comparison",
    )


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.decision_view import show_decision
    from fieldcal.commands.lot_prior_view import show_lot_prior
    from fieldcal.commands.over_time_view import show_over_time
    from fieldcal.commands.progress import SEARCH, show_work
    from fieldcal.commands.table import show_calibration
    from fieldcal.run.resuming import is_decided
    from fieldcal.run.untaken import untaken_sentence
    from fieldcal.session.folder import RESULT, Session

    session = Session.open(args.session)
    with show_work(args, f"{SEARCH} {args.session}"):
        found = _solve_and_decide(args, session)
    if args.json:
        for warning in found.warnings:
            sys.stderr.write(f"fieldcal solve: {warning}\n")
        sys.stdout.write(json.dumps(found.to_json()) + "\n")
    else:
        show_calibration(found)
        show_lot_prior(found)
        show_over_time(found)
        show_decision(found, session.folder if is_decided(session) else None)
    if lacking := untaken_sentence(session):
        sys.stderr.write(f"fieldcal solve: {lacking}\n")
    path = keep_result(session, RESULT, found.to_json())
    if not args.json:
        sys.stdout.write(f"written: {path}\n")
    go = found.info.get("decision", {}).get("go", True)
    return 0 if found.good and go else 1


def _solve_and_decide(args: argparse.Namespace, session: Session) -> Calibration:
    """Calibration of a session with what the options ask for, and its decision."""
    from fieldcal.commands.install_values import add_install_values
    from fieldcal.evaluation.repaired_session import repaired_session, with_repairs
    from fieldcal.evaluation.usable_windows import usable_windows
    from fieldcal.session.result_source import with_source

    repaired: tuple[str, ...] = ()
    if not args.as_printed:
        session, repaired = repaired_session(session)
    still = usable_windows(session)
    found = _solve_session(args, session, still)
    found = with_repairs(found, repaired)
    found = add_install_values(found, session)
    over_time = _solve_over_time(session) if args.over_time else None
    if over_time is not None:
        found = replace(found, info={**found.info, "over_time": over_time})
    return with_source(_decide(args, found, session, still), session.folder)


def _solve_session(
    args: argparse.Namespace, session: Session, still: UsableWindows
) -> Calibration:
    """Calibration from windows, turns and lot, with the options of the command."""
    from fieldcal.evaluation.solution import solve_session

    return solve_session(
        session,
        still,
        args.turns,
        _factory_options(args),
        method=args.method,
        tilt=args.tilt,
        cross=args.cross,
        as_printed=args.as_printed,
        level_sigma_deg=args.level,
        heading_sigma_deg=args.heading,
        angle_sigma_deg=args.angles,
        lot=_lot_prior(args, session) if args.lot else None,
    )


def _solve_over_time(session: Session) -> dict[str, Any]:
    """Each parameter's uncertainty against the averaging time.

    Raises
    ------
    InputError
        If the windows are too short.

    """
    from fieldcal.evaluation.nested_windows import solve_nested_windows

    found = solve_nested_windows(session)
    if found is None:
        raise InputError(
            "--over-time needs windows of 5 s or more with samples: leave it out"
        )
    return found.to_json()


def _factory_options(args: argparse.Namespace) -> dict[str, float]:
    """Errors left by the factory, as far as options state them."""
    said = {name: getattr(args, name) for name in FACTORY_KEYS}
    return {name: value for name, value in said.items() if value is not None}


def _lot_prior(args: argparse.Namespace, session: Session) -> LotPrior:
    """Prior from the units of the store that --lot selects, without this unit."""
    from fieldcal.commands.stored_sessions import find_stored_sessions
    from fieldcal.fleet.lot_prior import estimate_lot_prior
    from fieldcal.history import filters
    from fieldcal.history.database import Database
    from fieldcal.history.location import default_location
    from fieldcal.session.recorded_part import recorded_part

    wanted = filters.parse_filters(args.lot)
    database = Database(args.history or default_location())
    some = find_stored_sessions(database, wanted, "solve", documents=True)
    serial = str(session.about.device.get("serial", ""))
    folder = str(session.folder.resolve())
    part = recorded_part(session.folder)
    return estimate_lot_prior(" ".join(args.lot), some, serial, folder, part)


def _decide(
    args: argparse.Namespace, found: Calibration, session: Session, still: UsableWindows
) -> Calibration:
    """The calibration with its decision, if the session is of a run or has limits."""
    from fieldcal.acceptance.assessment import assess, limits_path, with_faults
    from fieldcal.calibration import limits
    from fieldcal.history.location import default_location
    from fieldcal.history.store import History

    bounds = limits.read(session.grade, limits_path(session, args.limits))
    if args.limits is None and "run" not in session.about.raw:
        return with_faults(found, session, still, bounds)
    history = History(args.history or default_location())
    return assess(found, session, still, bounds, history)
