"""`fieldcal plan`: choose positions and predict the ± of each parameter."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.commands.plan_file import (
    plan_tables,
    select_positions,
    write_plan,
)
from fieldcal.commands.plan_noise import read_device_noise
from fieldcal.commands.plan_speed import RESTS, SPINS, add_speed_options, show_spins
from fieldcal.commands.plan_view import (
    PlanPrediction,
    averaging_sentence,
    show_prediction,
)
from fieldcal.commands.site import add_site_options
from fieldcal.core.errors import PlanError
from fieldcal.core.factory import FACTORY_KEYS

if TYPE_CHECKING:
    from fieldcal.core.positions import Position
    from fieldcal.planning.planner import GradeNoise, Ladder
    from fieldcal.session.description import Description

RARE = (
    *("name", "serial", "lot", "station", "operator", "keeps_gyro_bias"),
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
    from fieldcal.planning import planner
    from fieldcal.session.description_file import parse_description

    tables = plan_tables(args)
    about = parse_description(tables)
    if args.speed is not None:
        return _plan_spins(args)
    if not 0 <= args.beta <= 90 or not 0 < args.alpha <= 180:
        raise PlanError("limits are 0 to 180° for α and 0 to 90° for β")
    ladder = planner.Ladder(math.radians(args.alpha), math.radians(args.beta))
    places = select_positions(args, ladder, about.gravity)
    seconds = _seconds_per_position(args.minutes, len(places))
    device = read_device_noise(args.noise_of, "acc") if args.noise_of else None
    grade = device.grade(seconds) if device else planner.GRADES[args.noise]
    needed = None if args.sways is None else _seconds_needed(args.sways, grade)
    found = _predict(places, seconds, grade, ladder, about)
    if args.output:
        write_plan(args.output, tables, places, seconds)
    if args.json:
        out = found.to_json()
        out["averaging"] = device.to_json() if device else grade.to_json()
        if needed is not None:
            out["needed_s"] = needed
        sys.stdout.write(json.dumps(out) + "\n")
        return 0
    show_prediction(found, "this device" if device else args.noise, grade)
    say = sys.stdout.write
    say(f"{device.sentence(seconds) if device else averaging_sentence(grade)}\n")
    if needed is not None:
        say(
            f"on a base that sways by 1° at {args.sways:g} Hz each position needs"
            f" {needed:.0f} s; this plan has {seconds:g} s\n"
        )
    if args.output:
        say(f"written: {args.output}\n")
    return 0


def _predict(
    places: Sequence[Position],
    seconds: float,
    grade: GradeNoise,
    ladder: Ladder,
    about: Description,
) -> PlanPrediction:
    """Predict what windows of so many seconds in these positions determine."""
    from fieldcal.core.positions import FIVE_POSITIONS
    from fieldcal.planning.aliasing import find_aliases
    from fieldcal.planning.planner import expected, extra_position

    gravity, mounting = about.gravity, about.mounting

    def sigmas(some: Sequence[Position]) -> Mapping[str, float]:
        return expected(some, grade, seconds, gravity, mounting)

    further = extra_position(places, ladder, gravity)
    return PlanPrediction(
        places,
        seconds,
        sigmas(places),
        sigmas(FIVE_POSITIONS),
        find_aliases(places, gravity, mounting),
        further,
        sigmas((*places, further)) if further else None,
    )


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
