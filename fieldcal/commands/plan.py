"""`fieldcal plan`: choose positions and predict the ± of each parameter."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.plan_file import (
    plan_tables,
    select_positions,
    write_plan,
)
from fieldcal.commands.plan_noise import read_device_noise
from fieldcal.commands.plan_speed import RESTS, SPINS, add_speed_options, show_spins
from fieldcal.commands.site import add_site_options
from fieldcal.core.errors import PlanError
from fieldcal.core.factory import FACTORY_KEYS

if TYPE_CHECKING:
    from fieldcal.core.positions import Position
    from fieldcal.planning.aliasing import Aliases
    from fieldcal.planning.planner import GradeNoise

RARE = (
    *("name", "serial", "lot", "station", "operator"),
    *("grade", "gravity", "mounting", *FACTORY_KEYS),
)

EXAMPLE = """\
  fieldcal plan --noise tactical --positions 5 --minutes 5 -o plan.toml
  fieldcal plan --set five
  fieldcal plan --of bench-7/2026-03-01 --sways 0.2
  fieldcal plan --noise-of bench-7/overnight
  fieldcal plan --speed 20 --positions 6 --minutes 10
  fieldcal run plan.toml --device "serial:/dev/ttyUSB0?format=witmotion"
"""

TURN_S = 10.0
"""Time to turn the device and let it settle, s."""

SHORTEST_S, LONGEST_S = 10.0, 60.0
"""Range of averaging times, s. Shorter windows are noisy, longer ones drift or are
disturbed."""

PAPER_COLUMN = "the paper's five"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "--positions",
        type=int,
        metavar="N",
        help="how many (default: 5; 6 with --speed)",
    )
    add("--minutes", type=float, default=5.0, help="time for all (default: 5)")
    add("--alpha", type=float, default=45.0, metavar="DEG", help="limit (default: 45)")
    add("--beta", type=float, default=5.0, metavar="DEG", help="limit (default: 5)")
    add("--noise", default="tactical", choices=("consumer", "tactical", "navigation"))
    add(
        "--noise-of",
        type=Path,
        metavar="SESSION",
        help="use the noise found by fieldcal noise (session folder, or noise.json)",
    )
    add(
        "--set",
        choices=("two", "five", "wide", "six_faces"),
        help="evaluate a known set instead of choosing positions",
    )
    add(
        "--of",
        type=Path,
        metavar="FILE",
        help="evaluate the positions of a session or a plan",
    )
    add(
        "--sways",
        type=float,
        metavar="HZ",
        help="also how long windows must be on a base that sways by 1° at HZ",
    )
    add(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="write the plan for fieldcal run",
    )
    add("--json", action="store_true", help="print one JSON object")
    add_speed_options(parser)
    add_site_options(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    import numpy as np

    from fieldcal.core.positions import FIVE_POSITIONS
    from fieldcal.planning import planner
    from fieldcal.planning.aliasing import find_aliases
    from fieldcal.session.description_file import parse_description

    tables = plan_tables(args)
    about = parse_description(tables)
    gravity, mounting = about.gravity, about.mounting
    if args.speed is not None:
        return _plan_spins(args)
    if not 0 <= args.beta <= 90 or not 0 < args.alpha <= 180:
        raise PlanError("limits are 0 to 180° for α and 0 to 90° for β")
    ladder = planner.Ladder(*np.deg2rad([args.alpha, args.beta]).tolist())
    places = select_positions(args, ladder, gravity)
    seconds = _seconds_per_position(args.minutes, len(places))
    device = read_device_noise(args.noise_of, "acc") if args.noise_of else None
    grade = device.grade(seconds) if device else planner.GRADES[args.noise]
    noise = "this device" if device else args.noise
    needed = None if args.sways is None else _seconds_needed(args.sways, grade)
    found = planner.expected(places, grade, seconds, gravity, mounting)
    paper = planner.expected(FIVE_POSITIONS, grade, seconds, gravity, mounting)
    further = planner.extra_position(places, ladder, gravity)
    with_it = (
        planner.expected((*places, further), grade, seconds, gravity, mounting)
        if further
        else None
    )
    confused = find_aliases(places, gravity, mounting)
    if args.output:
        write_plan(args.output, tables, places, seconds)
    if args.json:
        out = _plan_document(places, seconds, found, confused, further, with_it)
        out["averaging"] = device.to_json() if device else grade.to_json()
        if needed is not None:
            out["needed_s"] = needed
        sys.stdout.write(json.dumps(out) + "\n")
        return 0
    _print_plan(places, seconds, noise, grade, found, paper, with_it)
    _print_aliases(confused, further)
    sys.stdout.write(
        f"{device.sentence(seconds) if device else _averaging_sentence(grade)}\n"
    )
    if needed is not None:
        sys.stdout.write(
            f"on a base that sways by 1° at {args.sways:g} Hz each position needs"
            f" {needed:.0f} s; this plan has {seconds:g} s\n"
        )
    if args.output:
        sys.stdout.write(f"written: {args.output}\n")
    return 0


def _seconds_needed(hz: float, grade: GradeNoise) -> float:
    """Averaging time that a position needs on a base that sways at `hz`, s.

    Raises
    ------
    PlanError
        If the frequency is not above 0.

    """
    from fieldcal.planning.swaying_base import window_seconds_needed

    if not 0 < hz < math.inf:
        raise PlanError("--sways is a frequency in Hz, above 0")
    return window_seconds_needed(hz, grade)


def _plan_spins(args: argparse.Namespace) -> int:
    """Plan windows on a rate table."""
    from fieldcal.planning.planner import GRADES

    spins = SPINS if args.positions is None else args.positions
    if spins < 1:
        raise PlanError(f"--positions {spins}: the table must turn once at least")
    windows = spins + RESTS
    seconds = _seconds_per_position(args.minutes, windows)
    device = read_device_noise(args.noise_of, "gyr") if args.noise_of else None
    grade = device.grade(seconds) if device else GRADES[args.noise]
    noise = "this device" if device else args.noise
    return show_spins(args, grade.gyr(seconds), seconds, noise)


def _seconds_per_position(minutes: float, n: int) -> float:
    """Averaging time of each of n positions within some minutes, s."""
    if not math.isfinite(minutes):
        raise PlanError(f"--minutes {minutes:g}: give the time for all positions")
    each = 60 * minutes / n - TURN_S
    if each < SHORTEST_S:
        raise PlanError(
            f"{minutes:g} min for {n} positions leave {max(each, 0):.0f} s to average"
            f" after {TURN_S:g} s to turn: allow"
            f" {n * (SHORTEST_S + TURN_S) / 60:.1f} min or take fewer positions"
        )
    return float(min(LONGEST_S, round(each)))


def _averaging_sentence(grade: GradeNoise) -> str:
    """Sentence about the averaging time from which longer windows gain little."""
    return (
        f"flicker wins over white noise from {grade.acc_seconds:.0f} s"
        f" (accelerometers) and {grade.gyr_seconds:.0f} s (gyroscopes): longer windows"
        " gain little"
    )


def _plan_document(
    chosen: Sequence[Position],
    seconds: float,
    found: Mapping[str, float],
    confused: Aliases,
    further: Position | None,
    with_it: Mapping[str, float] | None,
) -> dict[str, Any]:
    from fieldcal.session.position_tables import position_table

    extra = further and {**position_table(further), "sigma": dict(with_it or {})}
    return {
        "positions": [position_table(p) for p in chosen],
        "seconds": seconds,
        "sigma": dict(found),
        "hidden": list(confused.hidden),
        "aliases": {name: list(others) for name, others in confused.pairs},
        "extra_position": extra,
    }


def _print_plan(
    chosen: Sequence[Position],
    seconds: float,
    noise: str,
    grade: GradeNoise,
    found: Mapping[str, float],
    paper: Mapping[str, float],
    with_it: Mapping[str, float] | None,
) -> None:
    from rich.table import Table

    from fieldcal.commands.console import EscapingConsole

    console = EscapingConsole()
    console.print(f"{len(chosen)} positions, {seconds:g} s each:")
    for i, position in enumerate(chosen, start=1):
        console.print(f"  {i}  {position.name}")
    mean = f"{1e3 * grade.acc(seconds):.2f} mm/s² a mean"
    title = f"Expected ± 1σ by noise alone ({noise}: {mean})"
    table = Table(title=title, title_justify="left")
    plans = {"this plan": found, PAPER_COLUMN: paper}
    if with_it is not None:
        plans["one more"] = with_it
    for column in ("parameter", *plans, "unit"):
        table.add_column(column, justify="right" if column in plans else "left")
    for name in dict.fromkeys([*found, *paper]):
        cells = [_sigma_cell(sigmas.get(name)) for sigmas in plans.values()]
        table.add_row(name, *cells, _unit_of_parameter(name))
    console.print(table)
    console.print(
        "how well angles are set and how square the axes are comes in addition"
    )


def _sigma_cell(sigma: float | None) -> str:
    return "not determined" if sigma is None else f"{sigma:.2g}"


def _unit_of_parameter(name: str) -> str:
    from fieldcal.calibration.names import group_of

    units = {"acc_bias": "m/s²", "acc_scale": "1", "gyr_bias": "rad/s"}
    return units.get(group_of(name), "°")


def _print_aliases(confused: Aliases, further: Position | None) -> None:
    say = sys.stdout.write
    worth = further.name if further else "none within the limits"
    say(f"one more position worth most: {worth}\n")
    if confused.hidden:
        say(f"goes into the calibration unseen: {', '.join(confused.hidden)}\n")
    for name, others in confused.pairs:
        say(f"{name} cannot be told from {' or '.join(others)}\n")
