"""`fieldcal apply`: apply a calibration to the samples of a recording."""

from __future__ import annotations

import argparse
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa

    from fieldcal.calibration import Calibration
    from fieldcal.core.samples import Block
    from fieldcal.session.folder import Session

EXAMPLE = """\
  fieldcal apply bench-7/2026-03-01 calibrated.csv
  fieldcal apply bench-7/today calibrated.csv --calibration bench-7/2026-03-01
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder with the samples")
    add("out", type=Path, metavar="OUT", help="file to write: .csv, .csv.gz, .parquet")
    add(
        "--calibration",
        type=Path,
        help="another solved session, or its result.json; by default the session's own",
    )


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.calibration import Nominal
    from fieldcal.commands.compare import read_calibration
    from fieldcal.commands.decision_view import reasons_against
    from fieldcal.commands.install_values import check_same_installed
    from fieldcal.session.folder import Session

    session = Session.open(args.session)
    calibration = read_calibration(args.calibration or args.session)
    _check_same_device(args, calibration, session)
    check_same_installed(calibration, session)
    nominal = Nominal(**{k: tuple(v) for k, v in session.about.nominal.items()})
    known = len(session.warnings)
    block = calibration.apply(session.block, nominal)
    for sentence in session.warnings[known:]:  # samples that were cut off or left out
        sys.stderr.write(f"fieldcal apply: {sentence}\n")
    if kept := _nominal_parameters(calibration, block):
        sys.stderr.write(
            "fieldcal apply: not determined, the nominal value is taken:"
            f" {', '.join(kept)}\n"
        )
    if reasons := reasons_against(calibration):
        sys.stderr.write(f"fieldcal apply: NO-GO: {'; '.join(reasons)}\n")
    _write_samples(args.out, block)
    sys.stdout.write(f"written: {args.out}, {len(block)} samples, m/s^2 and rad/s\n")
    return 0


def _check_same_device(
    args: argparse.Namespace, calibration: Calibration, session: Session
) -> None:
    """Refuse a calibration of another device; without serial numbers nobody knows.

    Raises
    ------
    InputError
        Naming both.

    """
    from fieldcal.core.errors import InputError

    devices = calibration.info.get("device", {}), session.about.device
    theirs, ours = (str(d.get("serial", "")).strip() for d in devices)
    if theirs and ours and theirs != ours:
        raise InputError(
            f"{args.calibration or args.session}: is a calibration of device {theirs},"
            f" and {args.session} was recorded with {ours}: name one of this device"
        )


def _nominal_parameters(calibration: Calibration, block: Block) -> list[str]:
    """Names of biases and scale factors that were not determined, of what was measured.

    A group of which nothing was determined is named as a whole.
    """
    from fieldcal.calibration.names import group_of

    sensors = {"acc": block.acc, "gyr": block.gyr}
    measured = [name for name, three in sensors.items() if (three == three).any()]
    out = [n for n in calibration.undetermined if n[:3] in measured]
    whole = (n if group_of(n) in calibration.groups else group_of(n) for n in out)
    return list(dict.fromkeys(whole))


def _with_units(table: pa.Table) -> pa.Table:
    """The table with the unit of each column as metadata."""
    import pyarrow as pa

    from fieldcal.core.samples import CHANNELS, UNITS

    units = {"t": "s", **dict(zip(CHANNELS, UNITS, strict=True)), "temperature": "degC"}
    fields = [
        field.with_metadata({"unit": units[field.name]} if field.name in units else {})
        for field in table.schema
    ]
    return pa.Table.from_arrays(table.columns, schema=pa.schema(fields))


def _write_samples(path: Path, block: Block) -> None:
    """Write samples in the columns of a session.

    Raises
    ------
    InputError
        If the ending of the name is unknown, or the file cannot be written.

    """
    import pyarrow as pa
    from pyarrow import csv, parquet

    from fieldcal.core.errors import InputError, disk_says
    from fieldcal.session.sample_table import to_record_batch

    table = pa.Table.from_batches([to_record_batch(block)])
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        if path.name.endswith(".csv"):
            csv.write_csv(table, part)
        elif path.name.endswith(".csv.gz"):
            with pa.CompressedOutputStream(part, "gzip") as stream:
                csv.write_csv(table, stream)
        elif path.name.endswith(".parquet"):
            parquet.write_table(_with_units(table), part)
        else:
            raise InputError(
                f"{path.name}: samples are written as .csv, .csv.gz or .parquet"
            )
        part.replace(path)
    except OSError as fault:
        raise InputError(f"{path}: cannot be written: {disk_says(fault)}") from fault
    finally:
        with suppress(OSError):  # a disk that is read-only, or gone
            part.unlink(missing_ok=True)
