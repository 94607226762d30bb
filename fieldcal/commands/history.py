"""`fieldcal history`: show the earlier calibrations of a device."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.escaping import escape_line

if TYPE_CHECKING:
    from fieldcal.calibration.limits import GradeLimits
    from fieldcal.history.store import History, HistoryRun
    from fieldcal.history.trend import TrendPoint

EXAMPLE = """\
  fieldcal history
  fieldcal history A1B2 --parameter gyr_bias.x
  fieldcal history A1B2 --compare 3 7
  fieldcal history A1B2 --png bias.png
"""

STRIP_WIDTH = 20
"""Width of the plot beside the numbers, characters."""


UNKNOWN_TIME = "at an unknown time"
"""Instead of the time of a recording whose stamps do not tell it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "serial",
        nargs=argparse.OPTIONAL,
        metavar="SERIAL",
        help="serial number of the device; without it all devices are listed",
    )
    add(
        "--parameter",
        action="append",
        metavar="NAME",
        help="such as acc_bias.x; may be given several times (default: all biases)",
    )
    add(
        "--compare",
        nargs=2,
        type=int,
        metavar="N",
        help="compare the two calibrations with these numbers",
    )
    add(
        "--accept",
        type=int,
        metavar="N",
        help="begin a new family with this calibration, as after a repair",
    )
    add("--png", type=Path, metavar="FILE", help="write a plot")
    add("--limits", type=Path, metavar="FILE", help="limits for the out-of-family test")
    add("--history", metavar="FILE", help="use this history")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.stored_sessions import tell_shorter_copies
    from fieldcal.core.errors import InputError
    from fieldcal.history.location import default_location
    from fieldcal.history.store import History

    history = History(args.history or default_location())
    if args.serial is None:
        _check_no_device_is_wanted(args)
        return _list_devices(args, history)
    if args.accept is not None:
        history.accept(args.serial, args.accept)
    runs = history.runs(args.serial)
    if not runs:
        known = ", ".join(s for s, _, _ in history.serials()) or "none yet"
        raise InputError(
            f"{history.database.location_text} has no calibration of {args.serial}; it"
            f" has {known}"
        )
    tell_shorter_copies(history.database, {"serial": args.serial}, "history")
    if args.compare:
        return _compare_runs(args, runs)
    return _show_trends(args, runs)


def _check_no_device_is_wanted(args: argparse.Namespace) -> None:
    """Refuse options that are about one device, where none is named."""
    from fieldcal.core.errors import InputError

    for name in ("parameter", "compare", "accept", "png"):
        if getattr(args, name) not in (None, [], ()):
            raise InputError(
                f"--{name} is about one device: name it, as in fieldcal history A1B2"
                f" --{name} …; fieldcal history alone lists them"
            )


def _list_devices(args: argparse.Namespace, history: History) -> int:
    devices = history.serials()
    if args.json:
        keys = ("serial", "calibrations", "last")
        rows = [dict(zip(keys, device, strict=True)) for device in devices]
        sys.stdout.write(json.dumps({"devices": rows}) + "\n")
        return 0
    if not devices:
        sys.stdout.write(
            f"{history.database.location_text}: no calibration yet; fieldcal run"
            " --serial keeps them\n"
        )
    for serial, count, last in devices:
        many = "1 calibration" if count == 1 else f"{count} calibrations"
        sys.stdout.write(
            f"{escape_line(serial)}: {many},"
            f" the last {escape_line(last) or UNKNOWN_TIME}\n"
        )
    return 0


def _compare_runs(args: argparse.Namespace, runs: Sequence[HistoryRun]) -> int:
    from fieldcal.calibration import compare
    from fieldcal.commands.compare import comparison_document, comparison_table
    from fieldcal.core.errors import InputError

    known = {run.number: run for run in runs}
    missing = [n for n in args.compare if n not in known]
    if missing:
        raise InputError(
            f"{args.serial} has no calibration number {missing[0]}; it has"
            f" {', '.join(map(str, known))}"
        )
    first, second = (known[n] for n in args.compare)
    found = compare(first.calibration, second.calibration)
    if args.json:
        sys.stdout.write(json.dumps(comparison_document(found)) + "\n")
        return 0
    for run_ in (first, second):
        sys.stdout.write(
            f"{run_.number}: {run_.taken_at or UNKNOWN_TIME},"
            f" {_format_temperature(run_)}\n"
        )
    sys.stdout.write(comparison_table(found))
    return 0


def _show_trends(args: argparse.Namespace, runs: Sequence[HistoryRun]) -> int:
    from fieldcal.calibration import limits
    from fieldcal.history.trend import parameter_names, parameter_trend

    grade = runs[-1].calibration.info.get("conditions", {}).get("grade", "tactical")
    bounds = limits.read(str(grade), args.limits)
    wanted = _selected_parameters(args.parameter, parameter_names(runs))
    trends = {name: parameter_trend(runs, name, bounds) for name in wanted}
    if args.png:
        from fieldcal.commands.history_plot import plot_trends

        left_out = plot_trends(args.png, args.serial, trends)
        sys.stderr.write(f"written: {args.png}{left_out}\n")
    if args.json:
        document = {
            "serial": args.serial,
            "runs": [_run_document(r) for r in runs],
            "parameters": {n: [p.to_json() for p in t] for n, t in trends.items()},
        }
        sys.stdout.write(json.dumps(document) + "\n")
        return 0
    _print_trends(args.serial, runs, trends, bounds)
    return 0


def _selected_parameters(
    asked: Sequence[str] | None, known: Sequence[str]
) -> list[str]:
    from fieldcal.calibration.names import group_of
    from fieldcal.core.errors import InputError

    if not asked:
        biases = [n for n in known if group_of(n) in ("acc_bias", "gyr_bias")]
        return biases or list(known)
    odd = [name for name in asked if name not in known]
    if odd:
        raise InputError(f"no calibration has {odd[0]}; there are {', '.join(known)}")
    return list(asked)


def _run_document(run: HistoryRun) -> dict[str, Any]:
    return {
        "number": run.number,
        "taken_at": run.taken_at,
        "session": run.session,
        "go": run.go,
        "accepted": run.accepted,
        "temperature_c": run.temperature,
        "latitude_deg": run.latitude_deg,
        "height_m": run.height_m,
        "software": run.software,
    }


def _format_temperature(run: HistoryRun) -> str:
    return "? °C" if run.temperature is None else f"{run.temperature:.1f} °C"


def _print_trends(
    serial: str,
    runs: Sequence[HistoryRun],
    trends: dict[str, list[TrendPoint]],
    bounds: GradeLimits,
) -> None:
    from fieldcal.calibration.wording import format_unit

    say = sys.stdout.write
    many = "1 calibration" if len(runs) == 1 else f"{len(runs)} calibrations"
    say(f"{escape_line(serial)}: {many}\n")
    for name, points in trends.items():
        unit = format_unit(points[-1].unit)
        say(f"\n{name}{f', {unit}' if unit else ''}\n")
        for line in trend_lines(points):
            say(line + "\n")
        say(f"  {_family_text(points)}\n")


def _family_text(points: Sequence[TrendPoint]) -> str:
    """Spread of a parameter from run to run, and which runs are out of family."""
    from fieldcal.calibration.wording import format_unit

    last = points[-1]
    if not math.isfinite(last.spread):
        return "not judged: the limits of the grade have no spread for it"
    text = f"spread from run to run ± {last.spread:.2g} {format_unit(last.unit)}"
    text = text.rstrip()
    if not any(math.isfinite(p.chance) for p in points):
        return f"{text}, by the limits of the grade; nothing to compare with"
    odd = [str(p.run.number) for p in points if p.out_of_family]
    return (
        f"{text}; out of family: {', '.join(odd)}" if odd else f"{text}; all in family"
    )


def trend_lines(points: Sequence[TrendPoint]) -> list[str]:
    """A line for each calibration: number, date, value, and a plot of the value.

    The plot spans all values ± 2 sigma; ``o`` is the value, ``-`` its ± 2 sigma.
    """
    from fieldcal.calibration.wording import format_with_sigma

    low = min(p.value - 2 * p.sigma for p in points)
    high = max(p.value + 2 * p.sigma for p in points)
    step = (high - low) / (STRIP_WIDTH - 1) or 1.0
    out = []
    for p in points:
        cells = [" "] * STRIP_WIDTH
        ends = (p.value - 2 * p.sigma, p.value + 2 * p.sigma)
        first, last = (round((end - low) / step) for end in ends)
        cells[first : last + 1] = "-" * (last + 1 - first)
        cells[round((p.value - low) / step)] = "o"
        value, sigma = format_with_sigma(p.value, p.sigma)
        word = "OUT" if p.out_of_family else "no-go" if p.run.go is False else ""
        word = "accepted" if p.run.accepted else word
        out.append(
            f"  {p.run.number:3d} {p.run.taken_at[:10] or '?':10}"
            f" {_format_temperature(p.run):>8}"
            f" {value:>10} ± {sigma:<8} |{''.join(cells)}| {word}".rstrip()
        )
    return out
