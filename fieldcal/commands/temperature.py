"""`fieldcal temperature`: combine calibrations at several temperatures."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.export import number_of_sensor
from fieldcal.commands.temperature_view import show_model
from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_line

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fieldcal.install.thermal import ThermalParameter, ThermalParameters
    from fieldcal.thermal import ThermalModel, ThermalPoint

RARE = ("limits", "instance", "force")

EXAMPLE = """\
  fieldcal temperature chamber/5C chamber/20C chamber/35C chamber/50C
  fieldcal temperature chamber/* --at 35 --json
  fieldcal temperature chamber/* --format ardupilot -o bench-7.param
  fieldcal temperature chamber/* --device mavlink:/dev/ttyACM0
"""

FORMATS = {"ardupilot": ".param", "px4": ".params", "json": ".json"}
"""Formats of the file, with the ending of its name."""

PX4_FLOAT, PX4_INT = 9, 6
"""Type codes of QGroundControl's files: 32 bit floating point and integer."""

DISAGREEMENT_SIGMAS = 4.0
"""Standard uncertainties beyond which a session disagrees with the others."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    what = "solved session folders of one device, or their result.json"
    add("sessions", type=Path, nargs="+", metavar="SESSION", help=what)
    add(
        "--at",
        type=float,
        metavar="DEGC",
        help="parameters at this temperature, and the error of the last session's"
        " parameters there",
    )
    add("--format", choices=FORMATS, help="of the file (default: json)")
    add("-o", "--output", type=Path, metavar="FILE", help="write a file")
    add("--device", metavar="URL", help="write onto an autopilot, and read back")
    add("--instance", type=number_of_sensor, default=0, metavar="N",
        help="autopilots: number of the sensor, from 0 (default: 0)")  # fmt: skip
    add("--yes", action="store_true", help="do not ask")
    add(
        "--force",
        action="store_true",
        help="write even if a session is NO-GO or disagrees",
    )
    add("--limits", type=Path, metavar="FILE", help="limits of your own")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 1 if a session disagrees with the others."""
    if args.format and not args.output:
        raise InputError("--format is of a file: name it with -o")
    points = read_points(args.sessions)
    found = fit_model(points, args.limits)
    document: dict[str, Any] = {
        **found.to_json(),
        "disagrees": find_disagreements(found),
    }
    if args.at is not None:
        document["at"] = _at_temperature(found, args.at, points[-1])
    if args.json:
        sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
    else:
        show_model(found, args.at, points[-1])
    for sentence in (*groups_left_out(points), *find_disagreements(found)):
        sys.stderr.write(f"fieldcal temperature: {sentence}\n")
    if args.output:
        _write_model(args, found, document)
    if args.device:
        _install_model(args, found, points)
    return 1 if find_disagreements(found) else 0


def read_points(paths: Sequence[Path]) -> list[ThermalPoint]:
    """Read the calibrations of sessions as thermal points.

    Raises
    ------
    InputError
        If a calibration cannot be used or is there twice, or they are of several
        devices.

    """
    from fieldcal.commands.compare import read_calibration
    from fieldcal.thermal import thermal_point

    points = [thermal_point(str(path), read_calibration(path)) for path in paths]
    serials = {
        str(p.calibration.info.get("device", {}).get("serial", "")): p.name
        for p in points
    }
    serials.pop("", None)
    if len(serials) > 1:
        listed = ", ".join(f"{name} of {serial}" for serial, name in serials.items())
        raise InputError(f"{listed}: give sessions of one device")
    _check_distinct(points)
    _check_other_samples(paths)
    return points


def _check_other_samples(paths: Sequence[Path]) -> None:
    """Refuse copies of a recording, of which one may have been continued since."""
    from fieldcal.session.folder import RESULT
    from fieldcal.session.recorded_part import same_recording

    folders = [path.parent if path.name == RESULT else path for path in paths]
    if pair := same_recording(folders):
        first, second = (paths[i] for i in pair)
        raise InputError(
            f"{second}: has samples of {first}: give each recording once, the longer"
        )


def _check_distinct(points: Sequence[ThermalPoint]) -> None:
    """Refuse a calibration that is there twice: it would count as two that agree."""
    known: dict[bytes, str] = {}
    for point in points:
        key = point.calibration.values.tobytes()
        if key in known:
            raise InputError(
                f"{known[key]} and {point.name} are the same calibration: give each"
                " session once"
            )
        known[key] = point.name


def fit_model(points: Sequence[ThermalPoint], limits: Path | None) -> ThermalModel:
    """Fit the model over temperature, with the limits of the device's grade.

    Raises
    ------
    InputError
        If temperatures are too few or too close to each other.

    """
    from fieldcal.calibration.limits import read
    from fieldcal.thermal import thermal_model

    grade = points[-1].calibration.info.get("conditions", {}).get("grade", "tactical")
    return thermal_model(points, read(str(grade), limits))


def groups_left_out(points: Sequence[ThermalPoint]) -> list[str]:
    """Sentences about parameter groups that not all sessions have."""
    from fieldcal.calibration.gauge import GROUPS
    from fieldcal.calibration.names import group_of
    from fieldcal.thermal.fit import common_parameters

    used = {name for names in common_parameters(points) for name in names}
    rest = {group_of(n) for p in points for n in p.calibration.names if n not in used}
    device = sorted(rest & GROUPS.keys())  # a tilt of the base is no part of it
    return [f"{group} is not in every session, and left out" for group in device]


def find_disagreements(found: ThermalModel) -> list[str]:
    """Sentences about sessions that disagree with the others, with the worst parameter.

    Each session is compared with the prediction from the others.
    """
    said = []
    for i, (name, temperature) in enumerate(found.sessions):
        worst = max(found.curves, key=lambda n: abs(found.curves[n].held_out[i]))
        z = found.curves[worst].held_out[i]
        if abs(z) > DISAGREEMENT_SIGMAS:
            said.append(
                f"{escape_line(name)} at {temperature:.1f} °C: {worst} is {abs(z):.1f}"
                " of its ± from what the other sessions predict: hysteresis, a jump, or"
                " another temperature than the thermometer's; take it again"
            )
    return said


def _at_temperature(
    found: ThermalModel, to: float, last: ThermalPoint
) -> dict[str, Any]:
    """Parameters at a temperature, and their change since the last session."""
    from fieldcal.thermal.wording import change_document

    values = found.at(to)
    return {
        "temperature_degc": to,
        "parameters": {
            n: {"value": v, "sigma": s, "unit": found.curves[n].unit}
            for n, (v, s) in values.items()
        },
        "since_degc": last.temperature,
        "change": change_document(found.change(to, last.temperature)),
    }


def _autopilot_parameters(
    autopilot: int,
    found: ThermalModel,
    instance: int,
    ids: Mapping[str, float] | None = None,
) -> ThermalParameters:
    from fieldcal.install.thermal import thermal_parameters

    made = thermal_parameters(autopilot, found, instance, ids)
    for sentence in made.says:
        sys.stderr.write(f"fieldcal temperature: {sentence}\n")
    return made


def _write_model(
    args: argparse.Namespace, found: ThermalModel, document: dict[str, Any]
) -> None:
    """Write the model in the format of the options.

    Raises
    ------
    InputError
        If the file exists already.

    """
    from fieldcal.drivers.mavlink_parameter_names import ARDUPILOT, PX4
    from fieldcal.session.file_writing import write_atomically

    path: Path = args.output
    if path.exists():
        raise InputError(f"{path}: is there already; name another file with -o")
    if args.format == "ardupilot":
        made = _autopilot_parameters(ARDUPILOT, found, args.instance)
        lines = [f"{n},{p.value:.9g}" for n, p in made.values.items()]
        text = _with_comments(made.says, lines)
    elif args.format == "px4":
        made = _autopilot_parameters(PX4, found, args.instance)
        lines = [_px4_line(n, p) for n, p in made.values.items()]
        head = "# Vehicle-Id Component-Id Name Value Type"
        text = _with_comments(made.says, [head, *lines])
    else:
        text = json.dumps(document, indent=2, allow_nan=False) + "\n"
    write_atomically(path, text)
    sys.stderr.write(f"written: {path}\n")


def _with_comments(says: Sequence[str], lines: Sequence[str]) -> str:
    head = ["# fieldcal: over temperature, m/s^2, rad/s, sensor axes"]
    return "\n".join([*head, *(f"# {s}" for s in says), *lines]) + "\n"


def _px4_line(name: str, parameter: ThermalParameter) -> str:
    value = f"{parameter.value:.9g}"
    return f"1\t1\t{name}\t{value}\t{PX4_INT if parameter.whole else PX4_FLOAT}"


def _install_model(
    args: argparse.Namespace, found: ThermalModel, points: Sequence[ThermalPoint]
) -> None:
    """Write the model onto an autopilot; the last session keeps the old parameters.

    Raises
    ------
    InstallRefused
        If a session is NO-GO, or disagrees with the others.

    """
    from fieldcal.commands.autopilot import (
        InstallRefused,
        check_ready,
        open_parameters,
        write_parameters,
    )
    from fieldcal.commands.write import change_table
    from fieldcal.drivers.mavlink_parameter_names import PX4
    from fieldcal.install.proposal import Change
    from fieldcal.install.thermal import id_names

    folder: Path = args.sessions[-1]
    if not folder.is_dir():
        raise InputError(
            f"{folder}: name the session's folder: the old set is kept in it"
        )
    decided = [p.calibration.info.get("decision") or {"go": True} for p in points]
    refused = [p.name for p, d in zip(points, decided, strict=True) if not d["go"]]
    if (refused or find_disagreements(found)) and not args.force:
        which = ", ".join(refused) or "a session that the others do not predict"
        raise InstallRefused(f"NO-GO, nothing is written: {which}; take it again")
    with open_parameters(args.device) as link:
        check_ready(link, link.autopilot)
        ids = link.read(id_names(args.instance)) if link.autopilot == PX4 else None
        made = _autopilot_parameters(link.autopilot, found, args.instance, ids)
        now = link.read(made.values)
        wanted = [
            Change(n, now[n], p.value, p.sigma, p.unit) for n, p in made.values.items()
        ]
        (sys.stderr if args.json else sys.stdout).write(change_table(wanted))
        new = {change.name: change.new for change in wanted}
        write_parameters(link, args.device, folder, now, new, args.yes)
    sys.stderr.write("restart the autopilot: it takes them in when it starts\n")
