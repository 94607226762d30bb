"""`fieldcal export`: write a calibration for another program."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

EXAMPLE = """\
  fieldcal export bench-7/today --format ardupilot
  fieldcal export bench-7/today --format mcap -o bench-7.mcap
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    from fieldcal.exporters import format_names

    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder, solved")
    add(
        "--format",
        required=True,
        choices=format_names(),
        help="; ".join(format_names()),
    )
    add("-o", "--output", type=Path, help="file (default: the session's name)")
    add(
        "--calibration",
        type=Path,
        help="another solved session, or its result.json; by default the session's own",
    )
    add(
        "--instance",
        type=number_of_sensor,
        default=0,
        metavar="N",
        help="autopilots: number of the sensor, from 0, if the recording does not state"
        " it (default: 0)",
    )


def number_of_sensor(text: str) -> int:
    """Number of a sensor, from 0."""
    from fieldcal.drivers.mavlink_parameter_names import MOST_SENSORS

    last = MOST_SENSORS - 1
    if not text.isdecimal() or int(text) > last:
        raise argparse.ArgumentTypeError(f"{text!r} is no number from 0 to {last}")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.calibration import Nominal
    from fieldcal.commands.compare import read_calibration
    from fieldcal.commands.decision_view import reasons_against
    from fieldcal.core.errors import InputError
    from fieldcal.exporters import ExportSource, load_exporter
    from fieldcal.install.proposal import installed_in
    from fieldcal.session.folder import Session

    session = Session.open(args.session)
    module = load_exporter(args.format)
    name = args.session.resolve().name
    path = args.output or Path(f"{name}{module.ENDING}")
    if path.exists():
        raise InputError(f"{path}: is there already; name another file with -o")
    nominal = Nominal(**{k: tuple(v) for k, v in session.about.nominal.items()})
    calibration = read_calibration(args.calibration or args.session)
    source = ExportSource(
        calibration,
        nominal,
        session,
        installed_in(session),
        args.instance,
    )
    known, said = len(session.warnings), list(module.write(source, path))
    # what was cut off or left out of the samples, where the format holds them
    for sentence in (*session.warnings[known:], *said):
        sys.stderr.write(f"fieldcal export: {sentence}\n")
    if reasons := reasons_against(calibration):
        sys.stderr.write(f"fieldcal export: NO-GO: {'; '.join(reasons)}\n")
    sys.stdout.write(f"{path}\n")
    return 0
