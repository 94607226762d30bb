"""`fieldcal write`: write a calibration onto an autopilot."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.drivers.mavlink_installed import InstalledCalibration
    from fieldcal.install.proposal import Change
    from fieldcal.session.folder import Session
from fieldcal.commands.autopilot import (
    InstallRefused,
    check_ready,
    open_parameters,
    write_parameters,
)

EXAMPLE = """\
  fieldcal write bench-7/2026-03-01 --device mavlink:/dev/ttyACM0
  fieldcal write bench-7/2026-03-01 -o bench-7.param
  fieldcal undo bench-7/2026-03-01 --device mavlink:/dev/ttyACM0
"""

SIGNIFICANT_SIGMAS = 3.0
"""Standard uncertainties beyond which a parameter counts as changed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session of an autopilot, solved")
    add("--device", metavar="URL", help="such as mavlink:udp:0.0.0.0:14550")
    add(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="write a parameter file instead: .param (Mission Planner), .params"
        " (QGroundControl)",
    )
    add("--yes", action="store_true", help="do not ask")
    add("--force", action="store_true", help="although it is NO-GO")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.compare import read_calibration
    from fieldcal.session.folder import Session

    if (args.device is None) == (args.output is None):
        raise InputError("say where to: --device URL, or -o FILE; one of them")
    session = Session.open(args.session)
    found = read_calibration(args.session)
    wanted, installed, says = propose_changes(session, found)
    _check_installable(found, wanted, installed, args.force)
    out = sys.stderr if args.json else sys.stdout
    out.write(change_table(wanted))
    for sentence in says:
        out.write(f"! {sentence}\n")
    if args.output:
        _write_file(args.output, wanted)
    else:
        _write_device(args, session, wanted, installed)
    if args.json:
        rows = [_change_document(change) for change in wanted]
        where = str(args.output or args.device)
        sys.stdout.write(json.dumps({"written": where, "parameters": rows}) + "\n")
    return 0


def propose_changes(
    session: Session, found: Calibration
) -> tuple[tuple[Change, ...], InstalledCalibration, tuple[str, ...]]:
    """Changes to write, the installed calibration, and messages for the user.

    Raises
    ------
    InputError
        If the session does not state the installed calibration.

    """
    from fieldcal.calibration import Nominal
    from fieldcal.drivers.mavlink_parameter_names import (
        GYRO_CAL_AT_START,
        replaced_at_start,
    )
    from fieldcal.install.proposal import (
        changes,
        installed_in,
        unsupported_parameters,
    )

    installed = installed_in(session)
    if installed is None:
        raise InputError(
            "the session was not recorded from an autopilot that told its parameters:"
            " record it over mavlink:, or write a file by fieldcal export"
        )
    nominal = Nominal(**{k: tuple(v) for k, v in session.about.nominal.items()})
    averages = installed.values.get(GYRO_CAL_AT_START, 0.0)
    says = (
        *unsupported_parameters(found),
        *replaced_at_start(installed.instance, averages),
    )
    return changes(found, nominal, installed), installed, says


def _check_installable(
    found: Calibration,
    wanted: Sequence[Change],
    installed: InstalledCalibration,
    force: bool,
) -> None:
    from fieldcal.commands.decision_view import reasons_against
    from fieldcal.install.proposal import problems

    reasons = reasons_against(found)
    if not found.info.get("decision"):
        reasons = ["nobody decided about it"]
    reasons += problems(tuple(wanted), installed)
    if reasons and not force:
        raise InstallRefused(
            f"NO-GO, nothing is written: {'; '.join(reasons)}; mend that and record"
            " again, or --force it"
        )


def change_table(wanted: Sequence[Change]) -> str:
    """Text with old and new values, uncertainty and significance of each change."""
    width = max(len(c.name) for c in wanted)
    lines = [
        f"{'parameter':{width}}  {'old':>12}    {'new':>12}   ± 1σ     unit   change/σ"
    ]
    for c in wanted:
        z = c.significance
        word = "" if not abs(z) > SIGNIFICANT_SIGMAS else "  changed"
        told = f"{z:+9.1f}{word}" if z == z else "     kept"
        lines.append(
            f"{c.name:{width}}  {c.old:12.6f} -> {c.new:12.6f}   {c.sigma:<8.2g}"
            f" {c.unit:5}{told}"
        )
    return "\n".join(lines) + "\n"


def _change_document(change: Change) -> dict[str, Any]:
    z = change.significance
    return {
        "name": change.name,
        "old": change.old,
        "new": change.new,
        "sigma": change.sigma,
        "unit": change.unit,
        "significance": z if z == z else None,
    }


def _write_file(path: Path, wanted: Sequence[Change]) -> None:
    """Write a parameter file in the format of its ending.

    Raises
    ------
    InputError
        If the ending is unknown.

    """
    from fieldcal.session.file_writing import write_atomically

    if path.suffix in (".param", ".parm"):
        lines = [f"{c.name},{c.new:.9g}" for c in wanted]
    elif path.suffix == ".params":
        lines = ["# Vehicle-Id Component-Id Name Value Type"]
        lines += [f"1\t1\t{c.name}\t{c.new:.9g}\t9" for c in wanted]
    else:
        raise InputError(f"{path}: end it in .param (Mission Planner) or .params (QGC)")
    write_atomically(path, "\n".join(lines) + "\n")
    sys.stderr.write(f"written: {path}\n")


def _write_device(
    args: argparse.Namespace,
    session: Session,
    wanted: Sequence[Change],
    installed: InstalledCalibration,
) -> None:
    known = {c.name: c.old for c in wanted}
    new = {c.name: c.new for c in wanted}
    with open_parameters(args.device) as link:
        check_ready(link, installed.autopilot)
        write_parameters(link, args.device, session.folder, known, new, args.yes)
