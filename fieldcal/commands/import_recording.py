"""`fieldcal import`: convert a recording from another program into a session."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING

from fieldcal.commands.import_columns import add_column_options, read_options
from fieldcal.commands.import_imu import import_imu, report_instances
from fieldcal.commands.site import add_site_options
from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_line
from fieldcal.core.factory import FACTORY_KEYS
from fieldcal.core.gravity import G0

if TYPE_CHECKING:
    from fieldcal.importing.recording import ImuStream, Recording
    from fieldcal.importing.session.ingest import ImportedSession

RARE = (
    *(
        "join",
        "in_order",
        "options",
        "sigma",
        "skip",
        "separator",
        "acc_lsb",
        "gyr_lsb",
        "acc_zero",
        "rate_sigma",
    ),
    *("temp_unit", "temp_lsb", "temp_zero", "name", "serial", "grade", "gravity"),
    *("lot", "station", "operator", "keeps_gyro_bias", *FACTORY_KEYS),
)

EXAMPLE = """\
  fieldcal import log.csv --columns t,ax,ay,az,gx,gy,gz --gyr-unit deg/s
  fieldcal import imu0.log.gz --columns ax,ay,az,gx,gy,gz --rate 100 -o imu0
  fieldcal import flight.ulg --list
  fieldcal import flight.bin --instance IMU.0
  fieldcal import drive.log --options "dbc=imu.dbc&map=ax=A.X,ay=A.Y,az=A.Z"
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("files", type=Path, nargs="+", metavar="FILE", help="recording, also as .gz")
    add("-o", "--output", type=Path, help="session folder (default: the file's name)")
    add(
        "--format",
        default="",
        metavar="NAME",
        help="format of the file (default: detected from the content)",
    )
    add("--list", action="store_true", help="list the IMUs in the file and stop")
    add(
        "--instance",
        action="append",
        default=[],
        metavar="NAME",
        help="only this IMU, as --list names it (default: each into its own folder)",
    )
    add(
        "--repair",
        action="store_true",
        help="leave out bad rows and damaged or incomplete parts, and report them",
    )
    add(
        "--join",
        action="store_true",
        help="FILEs have channels of one IMU at the same time",
    )
    add(
        "--in-order",
        action="store_true",
        help="FILEs are consecutive recordings of one IMU, such as one a position",
    )
    add(
        "--options",
        default="",
        metavar="QUERY",
        help="options of the format, as in a device address",
    )
    add_column_options(parser)
    add(
        "--still",
        type=float,
        default=1.0,
        metavar="S",
        help="shortest rest that counts as a position, s (default and least: 1)",
    )
    add(
        "--sigma",
        default="",
        metavar="A,G",
        help="uncertainties of the means in a table of means, m/s^2 and rad/s",
    )
    add_site_options(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.importers import open_recording
    from fieldcal.importing.session.joining import join_files
    from fieldcal.importing.session.merge import FilesInOrder

    if len(args.columns) not in (0, 1, len(args.files)):
        raise InputError("give --columns once, or once for each file")
    opened: list[Recording] = [
        open_recording(path, read_options(args, i), args.format, args.repair)
        for i, path in enumerate(args.files)
    ]
    if args.join and args.in_order:
        raise InputError("FILEs hold either the same time or one time after another")
    if args.join:
        opened = [join_files(opened)]
    if args.in_order:
        opened = [FilesInOrder(opened)]
    if args.list:
        return _list_streams(opened)
    written: list[Path] = []
    imported: list[ImportedSession] = []
    try:
        for recording in opened:
            imported += _import_streams(args, recording, len(opened) > 1, written)
    except InputError:
        # the same command with the answer must find its folders free
        for folder in written:
            rmtree(folder)
            sys.stderr.write(f"{folder}: removed again, for this is not all\n")
        raise
    _suggest_one_session(args.files, imported)
    return 0


def _suggest_one_session(
    files: Sequence[Path], imported: Sequence[ImportedSession]
) -> None:
    """Suggest --join or --in-order if the files seem to belong to one IMU."""
    import numpy as np

    from fieldcal.importing.units.gravity_size import are_means

    if len(files) == 2 and {one.facts.measured for one in imported} == {"a", "g"}:
        sys.stderr.write(
            "one of these files holds accelerometers and the other gyroscopes: if they"
            " are of one IMU, import them again with --join, which makes one session"
            " of them\n"
        )
    rests = [one.forces for one in imported]
    if len(files) > 1 and all(len(one) == 1 for one in rests):
        if are_means(np.concatenate(rests)):
            sys.stderr.write(
                f"each of these {len(files)} files holds one rest, and each faces"
                " another way: if they are positions of one IMU, import them again with"
                " --in-order, which makes one session of them\n"
            )


def _import_streams(
    args: argparse.Namespace, recording: Recording, among: bool, written: list[Path]
) -> list[ImportedSession]:
    """Make a session of each selected IMU of a recording.

    Parameters
    ----------
    args, recording : options, and the recording
    among : whether it is one of several files
    written : session folders; new ones are appended

    """
    name = recording.path.name.split(".")[0]
    folder = args.output or Path(name)
    if args.output and among:
        folder = args.output / name
    names = _selected_streams(recording, args.instance)
    imported: dict[str, ImportedSession] = {}
    inner = stream_folders([stream.name for stream in names])
    for stream in names:
        # each IMU of the file has its own messages
        one = recording.alone(stream.name)
        there = folder / inner[stream.name] if len(names) > 1 else folder
        imported[stream.name] = import_imu(args, one, stream, there)
        written.append(there)
    if len(names) > 1:
        rests = {name: one.forces for name, one in imported.items()}
        report_instances(folder, rests, float(args.gravity or G0))
    return list(imported.values())


def _list_streams(opened: list[Recording]) -> int:
    for recording in opened:
        for stream in recording.streams():
            named = (recording.path, stream.name, stream.says)
            sys.stdout.write("\t".join(escape_line(str(part)) for part in named) + "\n")
    return 0


def stream_folders(streams: Sequence[str]) -> dict[str, str]:
    """Folder name of each stream; a number makes equal names distinct.

    >>> stream_folders(["/a/b", "/a_b", "/c"])
    {'/a/b': 'a_b', '/a_b': 'a_b_2', '/c': 'c'}
    """
    found: dict[str, str] = {}
    for name in streams:
        plain = re.sub(r"[^\w.-]+", "_", name).strip("_.") or "imu"
        folder, number = plain, 2
        while folder.lower() in {taken.lower() for taken in found.values()}:
            folder, number = f"{plain}_{number}", number + 1
        found[name] = folder
    return found


def _selected_streams(recording: Recording, wanted: list[str]) -> list[ImuStream]:
    """Streams to be imported: the wanted ones, or all."""
    there = {stream.name: stream for stream in recording.streams()}
    for name in wanted:
        if name not in there:
            raise InputError(
                f"{recording.path}: has no {name}; there are {', '.join(there)}"
            )
    return [there[name] for name in wanted or there]
