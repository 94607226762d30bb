"""`--against` of `fieldcal diagnose`: compare a recording with a simulator."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.keep_result import keep_result

if TYPE_CHECKING:
    from fieldcal.against import Match
    from fieldcal.against.rounds import CompareOutput, SimulatorRun
    from fieldcal.against.sensor_model import SensorModel
    from fieldcal.session.folder import Session

    ComparedSession = tuple[Match, SensorModel | None, list[str]]
    """Result, sensor model for a patch, and messages for the user."""

DEFAULT_PATCH_FORMAT = "json"
"""Format of the patches for a simulator command, unless another is named."""


def run(args: argparse.Namespace) -> int:
    """Carry out the comparison; 0 if both agree within the limits, else 1."""
    from fieldcal.against.gate import check_match, parse_limits, write_junit
    from fieldcal.report.gather import AGAINST
    from fieldcal.session.folder import Session

    allowed = parse_limits(args.limit)
    session = Session.open(args.session)
    found, model, said = _compare_session(args, session)
    content = found.to_json() | {"against": args.against}
    form = args.patch or DEFAULT_PATCH_FORMAT
    patch = [] if model is None else [_write_patch(form, session, model, said)]
    for warning in (*session.warnings, *said, *found.warnings):
        sys.stderr.write(f"fieldcal diagnose: {warning}\n")
    _print_match(args, found, content)
    written = [keep_result(session, AGAINST, content), *patch]
    gate = check_match(found, allowed)
    if args.junit:
        write_junit(args.junit, args.session.resolve().name, found, gate)
        written.append(args.junit)
    if args.report:
        from fieldcal.commands.report import write_report

        written.append(write_report(args.session))
    for path in written:
        (sys.stderr if args.json else sys.stdout).write(f"written: {path}\n")
    beyond = [one for one in gate if not one.ok]
    for one in beyond if allowed else ():
        sys.stderr.write(f"fieldcal diagnose: not within its limit: {one.says}\n")
    return 1 if beyond else 0


def _compare_session(args: argparse.Namespace, session: Session) -> ComparedSession:
    """Compare with a file, or with the output of a command over several rounds."""
    import numpy as np

    from fieldcal.against.rounds import is_command, run_and_patch
    from fieldcal.against.sensor_model import patch_model

    compare = _comparison_method(args, session)
    if not is_command(args.against):
        found, said = compare(Path(args.against))
        return found, patch_model(found) if args.patch else None, said
    step = float(np.median(np.diff(session.block.t)))
    form = args.patch or DEFAULT_PATCH_FORMAT
    done = run_and_patch(
        args.against, compare, 1 / step, form, args.rounds, _report_simulator_run
    )
    last = done[-1]
    return last.match, last.patch, list(last.says)


def _comparison_method(args: argparse.Namespace, session: Session) -> CompareOutput:
    """Function that compares: by positions, or by the motion if it holds too few."""
    from fieldcal.against import compare_sides
    from fieldcal.against.motion.held import what_is_held
    from fieldcal.against.opening import open_simulator_output
    from fieldcal.against.side import diagnose_side
    from fieldcal.commands.progress import SEARCH, show_work

    if args.motion or what_is_held(session.block, session.about) == "motion":
        return partial(_compare_by_motion, args, session)
    with show_work(args, f"{SEARCH} {args.session}"):
        real = diagnose_side(str(args.session), session.block, session.about)

    def by_positions(path: Path) -> tuple[Match, list[str]]:
        block, about, said = open_simulator_output(path, (session.block, session.about))
        with show_work(args, f"{SEARCH} {path}"):
            simulated = diagnose_side(args.against, block, about, real)
            return compare_sides(real, simulated), list(said)

    return by_positions


def _compare_by_motion(
    args: argparse.Namespace, session: Session, path: Path
) -> tuple[Match, list[str]]:
    """Compare with a simulator output that follows the recorded motion."""
    from fieldcal.against.motion import compare_in_motion
    from fieldcal.against.opening import read_output
    from fieldcal.against.sensor_model import CALIBRATION
    from fieldcal.commands.progress import SEARCH, show_work

    read = read_output(path)
    recorded = (session.block, session.about)
    with show_work(args, f"{SEARCH} how {args.session} and {path} differ"):
        found = compare_in_motion(
            recorded, read.block, (str(args.session), args.against)
        )
    said = list(read.says)
    if args.patch and any(d.id in CALIBRATION for d in found.differences):
        said.append(
            "a motion does not show the simulator's own biases and scale factors: the"
            " patch has those of a simulator that had none before"
        )
    if args.patch and any(d.id == "misalignment" for d in found.differences):
        said.append(
            f"{args.patch} has nothing for misalignment: the patch is in the axes of"
            " the recording, so turn those of the simulator first"
        )
    return found, said


def _report_simulator_run(number: int, one: SimulatorRun) -> None:
    """Print a line about a run of the simulator."""
    differ = ", ".join(d.id.replace("_", " ") for d in one.match.differences)
    sys.stderr.write(
        f"run {number}{', patched' if number else ''}: {differ or 'nothing'} differs,"
        f" χ²/dof {one.match.before.chi2_per_dof:.3g}\n"
    )


def _write_patch(
    form: str, session: Session, model: SensorModel, said: list[str]
) -> Path:
    """Write the patch beside the recording."""
    from fieldcal.against import patches

    path = session.folder / f"patch{patches.patch_format(form).ENDING}"
    said += patches.write(form, model, path)
    return path


def _print_match(
    args: argparse.Namespace, found: Match, content: Mapping[str, Any]
) -> None:
    """Print the result, as JSON or as a view."""
    if args.json:
        sys.stdout.write(json.dumps(content, allow_nan=False) + "\n")
        return
    from fieldcal.commands.against_view import show_match

    show_match(found, details=args.details)
