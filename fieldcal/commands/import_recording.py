"""`fieldcal import`: a session folder of a recording from elsewhere."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.site import add_site, site_tables
from fieldcal.errors import InputError, SessionError

if TYPE_CHECKING:
    from fieldcal.samples import Block

EXAMPLE = """\
  fieldcal import log.csv --columns t,ax,ay,az,gx,gy,gz --acc-unit g --gyr-unit deg/s
  fieldcal import imu0.log.gz --columns ax,ay,az,gx,gy,gz --rate 100 -o imu0
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="text file with columns, or its .gz")
    add("-o", "--output", type=Path, help="session folder (default: the file's name)")
    add(
        "--columns",
        required=True,
        help="what each column is, separated by commas: t, ax ay az, gx gy gz,"
        " temperature, seq, t_host, or _ to skip one",
    )
    add("--rate", type=float, metavar="HZ", help="sampling rate, where no column is t")
    add("--separator", help="between columns (default: found)")
    add("--skip", type=int, metavar="N", help="lines at the top (default: found)")
    add("--acc-unit", default="m/s^2", help="m/s^2 (default), g, mg, V, count")
    add("--gyr-unit", default="rad/s", help="rad/s (default), deg/s, mrad/s, V, count")
    add("--time-unit", default="s", help="s (default), ms, us, ns")
    add("--acc-lsb", type=float, default=1.0, metavar="N", help="counts in one unit")
    add("--gyr-lsb", type=float, default=1.0, metavar="N", help="counts in one unit")
    add(
        "--still",
        type=float,
        default=1.0,
        metavar="S",
        help="shortest still stretch that counts as a position, s (default: 1)",
    )
    add_site(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.importers.csv_like import Layout, read
    from fieldcal.windows import still_stretches

    layout = Layout(
        tuple(name.strip() for name in args.columns.split(",")),
        args.rate,
        args.separator,
        args.skip,
        args.acc_unit,
        args.gyr_unit,
        args.time_unit,
        args.acc_lsb,
        args.gyr_lsb,
    )
    block = read(args.file, layout)
    stretches = still_stretches(block, args.still)
    folder = args.output or Path(args.file.name.split(".")[0])
    about = {"format": 1, **site_tables(args, args.file.name.split(".")[0])}
    units = {"acceleration": args.acc_unit, "angular_rate": args.gyr_unit}
    if kept := {k: u for k, u in units.items() if u in ("V", "count")}:
        about["units"] = kept
    if args.rate:
        about["sampling"] = {"rate_hz": args.rate}
    about["position"] = [
        {"start_s": round(s, 6), "end_s": round(e, 6)} for s, e in stretches
    ]
    _write(folder, about, block)
    sys.stderr.write(
        f"{folder}: {len(block)} samples over {block.t[-1] - block.t[0]:.1f} s,"
        f" {len(stretches)} still stretches of {args.still:g} s or more\n"
    )
    if not stretches:
        sys.stderr.write(
            "no still stretch was found: write the positions into session.toml, or try"
            " --still with a shorter time\n"
        )
    sys.stdout.write(f"{folder}\n")
    return 0


def _write(folder: Path, about: dict[str, Any], block: Block) -> None:
    """Make the folder whole, or not at all."""
    import pyarrow as pa
    import pyarrow.parquet
    import tomlkit

    from fieldcal.sample_files import to_batch

    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder}: is not empty; name another folder with -o")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
        try:
            table = pa.Table.from_batches([to_batch(block)])
            pyarrow.parquet.write_table(table, part / "samples.parquet")
            (part / "session.toml").write_text(tomlkit.dumps(about), encoding="utf-8")
            part.chmod(0o755)
            part.replace(folder)
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            raise
    except OSError as error:
        raise SessionError(f"{folder}: cannot be written: {error}") from error
