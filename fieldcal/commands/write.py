"""`fieldcal write`: write a calibration onto an autopilot."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import FieldcalError, InputError

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.drivers.mavlink_installed import InstalledCalibration
    from fieldcal.drivers.mavlink_parameters import ParameterLink
    from fieldcal.install.proposal import Change
    from fieldcal.session.folder import Session

EXAMPLE = """\
  fieldcal write bench-7/2026-03-01 --device mavlink:/dev/ttyACM0
  fieldcal write bench-7/2026-03-01 -o bench-7.param
  fieldcal undo bench-7/2026-03-01 --device mavlink:/dev/ttyACM0
"""

SIGNIFICANT_SIGMAS = 3.0
"""Standard uncertainties beyond which a parameter counts as changed."""


class InstallRefused(FieldcalError):
    """The calibration must not be installed."""

    exit_code = 1


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
    from fieldcal.drivers.mavlink_installed import GYRO_CAL_AT_START, replaced_at_start
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


def write_parameters(
    link: ParameterLink,
    device: str,
    folder: Path,
    known: Mapping[str, float],
    new: Mapping[str, float],
    yes: bool,
) -> None:
    """Write parameters, after saving the old ones in a session's folder.

    Parameters
    ----------
    link, device : the autopilot, and its address
    folder : of the session
    known : values that the autopilot is expected to have
    new : values to write
    yes : whether to write without asking

    """
    from fieldcal.drivers.mavlink_parameters import same_float32
    from fieldcal.install.transaction import (
        WriteRolledBack,
        broken_off,
        check_unchanged,
        install,
        note_done,
        save,
        unfinished,
    )

    earlier = unfinished(folder)
    if earlier:  # its values come from an interrupted write
        now = link.read(known)
        old = {name: earlier[1]["old"].get(name, now[name]) for name in now}
        if said := broken_off(now, old, earlier[1]["new"]):
            sys.stderr.write(f"{said}\n")
    else:
        now = old = check_unchanged(link, known, "while it was recorded", new)
    if all(same_float32(now[name], value) for name, value in new.items()):
        if earlier:
            note_done(earlier[0], done=True)
        sys.stderr.write(f"all {len(new)} parameters are installed already\n")
        return
    confirm(f"write these {len(new)} parameters to {device}", yes)
    path = save(folder, device, old, new)
    if earlier:
        note_done(earlier[0], undone=True)
    try:
        install(link, old, new)
    except WriteRolledBack:
        note_done(path, undone=True)
        raise
    note_done(path, done=True)
    undo = f"fieldcal undo {folder} --device {device}"
    sys.stderr.write(
        f"written and read back: {len(new)} parameters; the old ones are in {path}\n"
        f"to take it back: {undo}\n"
    )


def open_parameters(url: str) -> Any:
    """Open the parameters of an autopilot.

    Raises
    ------
    InputError
        If the address is not of MAVLink, or pymavlink is not installed.

    """
    from importlib.util import find_spec

    scheme, _, address = url.partition(":")
    if scheme != "mavlink":
        raise InputError(
            f"{url}: parameters are written over mavlink:, such as"
            " mavlink:udp:0.0.0.0:14550; for other devices fieldcal export"
        )
    if not find_spec("pymavlink"):
        raise InputError("MAVLink needs pymavlink: pip install 'fieldcal[mavlink]'")
    from fieldcal.drivers.mavlink_parameters import ParameterLink

    return ParameterLink(address)


def check_ready(link: Any, autopilot: int) -> None:
    """Refuse an autopilot that is armed or runs another program.

    Raises
    ------
    InputError
        If the autopilot is refused.

    """
    if link.armed:
        raise InputError(f"{link.name}: the vehicle is armed: disarm it, then write")
    if link.autopilot != autopilot:
        raise InputError(
            f"{link.name}: this autopilot runs another program than the one that was"
            " recorded: name the right one"
        )


def confirm(what: str, yes: bool) -> None:
    """Ask the user for confirmation, unless `yes`.

    Raises
    ------
    InputError
        If there is no terminal to ask at.
    InstallRefused
        If the answer is no.

    """
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError(f"nobody is there to be asked: give --yes to {what}")
    sys.stderr.write(f"{what}? [y/N] ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InstallRefused("nothing was written, as you wished")
