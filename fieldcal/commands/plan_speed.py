"""`fieldcal plan --speed`: windows on a table of known speed, for gyroscopes."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping

from fieldcal.core.errors import PlanError
from fieldcal.core.samples import Array

SPINS, RESTS = 6, 2
"""Number of windows on the turning table unless given, and of windows at rest."""


def add_speed_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    group = parser.add_argument_group("gyroscopes on a table of known speed")
    add = group.add_argument
    add("--speed", type=float, metavar="DEG/S", help="of the table, about any axis")
    add(
        "--speed-sd",
        type=float,
        default=0.0,
        metavar="DEG/S",
        help="how well it is known (default: exactly)",
    )


def show_spins(
    args: argparse.Namespace, sigma: float, seconds: float, noise: str
) -> int:
    """Print how to mount the device on the table, and the expected uncertainties.

    Parameters
    ----------
    args : of the command
    sigma : standard error of a gyroscope's mean over a window, rad/s
    seconds : length of a window
    noise : name of the device or grade that `sigma` belongs to

    Raises
    ------
    PlanError
        If the table does not turn, its speed has no ±, or an option is for positions.

    """
    import numpy as np

    from fieldcal.planning.table_speed import NAMES, expected_by_speed, spin_axes

    if args.output or args.set or args.of or args.sways is not None:
        raise PlanError(
            "fieldcal run holds positions at rest: record the table, import it, and"
            " write speed_deg_s into session.toml; leave out -o, --set, --of and"
            " --sways"
        )
    axes = spin_axes(SPINS if args.positions is None else args.positions)
    speed, speed_sigma = np.deg2rad([args.speed, args.speed_sd]).tolist()
    found = expected_by_speed(axes, speed, speed_sigma, sigma, RESTS)
    missing = [name for name in NAMES if name not in found]
    if args.json:
        out = {
            "spins": [{"axis": one} for one in axes.tolist()],
            "rests": RESTS,
            "seconds": seconds,
            "speed_deg_s": args.speed,
            "sigma": found,
            "not_determined": missing,
        }
        sys.stdout.write(json.dumps(out) + "\n")
        return 0
    _print_spins(axes, seconds, found, f"{noise}: {sigma:.2g} rad/s a mean")
    if missing:
        sys.stdout.write(f"not determined: {', '.join(missing)}; take more spins\n")
    return 0


def _print_spins(
    axes: Array, seconds: float, found: Mapping[str, float], noise: str
) -> None:
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole()
    console.print(
        f"{len(axes)} spins and {RESTS} rests, {seconds:g} s each; in the device the"
        " table's axis is along"
    )
    for i, axis in enumerate(axes.tolist(), start=1):
        console.print(f"  {i}  {_axis_direction(axis)}")
    table = Table(title=f"Expected ± 1σ ({noise})", title_justify="left")
    for column in ("parameter", "this plan", "unit"):
        table.add_column(column, justify="right" if column == "this plan" else "left")
    for name, sigma in found.items():
        unit = "rad/s" if name.startswith("gyr_bias") else "1"
        table.add_row(name, f"{sigma:.2g}", unit)
    console.print(table)


def _axis_direction(axis: list[float]) -> str:
    """Words for a direction along an axis or between axes.

    >>> _axis_direction([0.7, 0.0, -0.7])
    'between +x and -z'
    """
    parts = [
        f"{'+' if value > 0 else '-'}{name}"
        for name, value in zip("xyz", axis, strict=True)
        if value
    ]
    return parts[0] if len(parts) == 1 else f"between {' and '.join(parts)}"
