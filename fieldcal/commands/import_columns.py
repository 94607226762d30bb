"""Options of `fieldcal import` for what a file does not state itself."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fieldcal.importing.read_options import ReadOptions


def add_column_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument_group(
        "files that do not say what is in them"
    ).add_argument
    add(
        "--columns",
        action="append",
        default=[],
        help="meaning of each column, separated by commas: t, ax ay az, gx gy gz,"
        " temperature, seq, t_host, or _ to skip one; -gx for a reversed axis;"
        " t=NAME,ax=NAME if the columns have names; with --join once for each FILE",
    )
    add("--rate", type=float, metavar="HZ", help="sampling rate, if no column is t")
    add(
        "--rate-sigma",
        type=_parse_rate_sigma,
        metavar="HZ",
        help="what is not known of the rate, 1 sigma (default: 0.7 %% of it)",
    )
    add("--separator", help="between columns (default: detected)")
    add("--skip", type=int, metavar="N", help="lines at the top (default: detected)")
    add(
        "--acc-unit",
        default="",
        help="m/s^2, mm/s^2, cm/s^2, ft/s^2, g, mg, ug …, V, count",
    )
    add(
        "--gyr-unit",
        default="",
        help="rad/s, mrad/s, deg/s, mdeg/s, deg/h, rpm …, V, count",
    )
    add(
        "--time-unit",
        default="",
        help="s, ms, us, ns, min, d, hhmmss …, or a tick: 0.1ms, 31.25us, 1/32768s",
    )
    add("--acc-lsb", type=float, default=1.0, metavar="N", help="counts in one unit")
    add("--gyr-lsb", type=float, default=1.0, metavar="N", help="counts in one unit")
    add(
        "--acc-zero",
        type=_parse_triad,
        default=(),
        metavar="X,Y,Z",
        help="numbers of the file at no acceleration, such as 32768,32768,32768;"
        " one for all three axes if they are alike",
    )
    add(
        "--temp-unit",
        default="",
        help="degC, ddegC, cdegC, mdegC, K, degF, count, none",
    )
    add("--temp-lsb", type=float, default=1.0, metavar="N", help="counts in 1 K")
    add("--temp-zero", type=float, default=0.0, metavar="C", help="deg C at count 0")


def read_options(args: argparse.Namespace, i: int) -> ReadOptions:
    """Options for reading the i-th file."""
    from fieldcal.importing.read_options import ReadOptions

    given = args.columns[min(i, len(args.columns) - 1)] if args.columns else ""
    columns = [name.strip() for name in given.split(",")] if given else []
    other_way = [name.partition("=")[0] for name in columns if name.startswith("-")]
    return ReadOptions(
        tuple(name.removeprefix("-") for name in columns),
        args.rate,
        args.separator,
        args.skip,
        args.acc_unit,
        args.gyr_unit,
        args.time_unit,
        args.acc_lsb,
        args.gyr_lsb,
        args.options,
        args.temp_unit,
        args.temp_lsb,
        args.temp_zero,
        reversed=frozenset(name.removeprefix("-") for name in other_way),
        acc_zero=args.acc_zero,
        means=bool(args.sigma),
    )


def _parse_triad(text: str) -> tuple[float, ...]:
    """Parse one number for each axis, or one for all.

    >>> _parse_triad("33000"), _parse_triad("1,2.5,-3")
    ((33000.0, 33000.0, 33000.0), (1.0, 2.5, -3.0))
    """
    try:
        numbers = tuple(float(one) for one in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (1, 3) or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(
            f"{text!r} cannot be: write one number or three, such as 33000,32900,33100"
        )
    return numbers * (3 // len(numbers))


def _parse_rate_sigma(text: str) -> float:
    """Parse what is not known of a rate, Hz.

    >>> _parse_rate_sigma("0.01")
    0.01
    """
    try:
        hz = float(text)
    except ValueError:
        hz = math.nan
    if not 0 <= hz < math.inf:
        raise argparse.ArgumentTypeError(
            f"{text!r} cannot be: write by how many Hz the rate may be wrong, such as"
            " 0.01"
        )
    return hz
