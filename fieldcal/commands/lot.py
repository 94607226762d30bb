"""`fieldcal lot`: show spread, yield, shifts and drift of a lot, and its odd units."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.core.escaping import escape_line
from fieldcal.core.grade import GRADES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fieldcal.fleet.lot import LotAnalysis
    from fieldcal.history.database import Database

RARE = ("limits", "history")

NAMES_SHOWN = 12
"""Number of names in the store that are listed if a condition finds none."""

ODD_UNITS_SHOWN = 12
"""Number of odd units that are listed; --json has all."""

EXAMPLE = """\
  fieldcal lot
  fieldcal lot lot=2026-11 station=B
  fieldcal lot model=MK2 since=2026-03-01 --report mk2.html
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "query",
        nargs="*",
        metavar="NAME=VALUE",
        help="model, lot, station, operator or serial, since or until a date (default:"
        " everything in the store)",
    )
    add("--report", type=Path, metavar="FILE", help="also write a page")
    add("--json", action="store_true", help="print one JSON object")
    add(
        "--fdr",
        type=float,
        default=0.05,
        metavar="Q",
        help="expected share of false alarms among odd units (default: 0.05)",
    )
    add("--grade", choices=GRADES, default="tactical",
        help="grade of the tolerances (default: tactical)")  # fmt: skip
    add("--limits", type=Path, metavar="FILE", help="tolerances of your own")
    add("--history", metavar="FILE", help="use this store")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 0 if in control, 1 with an odd unit, shift or drift."""
    from fieldcal.calibration import limits
    from fieldcal.commands.stored_sessions import find_stored_sessions
    from fieldcal.core.errors import InputError
    from fieldcal.fleet.lot import analyse_lot
    from fieldcal.history import filters
    from fieldcal.history.database import Database
    from fieldcal.history.location import default_location

    if not 0 < args.fdr < 1:
        raise InputError(f"--fdr {args.fdr:g}: give a share between 0 and 1")
    wanted = filters.parse_filters(args.query)
    database = Database(args.history or default_location())
    some = find_stored_sessions(database, wanted, "lot")
    if not some:
        raise InputError(_why_none(database, wanted))
    found = analyse_lot(some, limits.read(args.grade, args.limits), args.fdr)
    if args.report:
        from fieldcal.report.lot_page import render_lot_page
        from fieldcal.session.file_writing import write_atomically

        write_atomically(
            args.report, render_lot_page(found, " ".join(args.query) or "everything")
        )
    if args.json:
        sys.stdout.write(json.dumps(found.to_json(), allow_nan=False) + "\n")
    else:
        _print_lot(found)
        if args.report:
            sys.stdout.write(f"written: {args.report}\n")
    return 0 if found.in_control else 1


def _why_none(database: Database, wanted: Mapping[str, str]) -> str:
    """Why no session of the store meets all conditions, and what there is."""
    from fieldcal.history import filters, sessions

    since, until = wanted.get("since"), wanted.get("until")
    if since and until and since > until and not since.startswith(until):
        return f"since={since} is later than until={until}: exchange the two"
    for name, value in wanted.items():
        if name in filters.TIMES:
            continue
        known = database.run(lambda db, n=name: sessions.names_in_store(db, n))  # type: ignore[misc]
        if value not in known:
            shown = ", ".join(map(escape_line, known[:NAMES_SHOWN])) or "none yet"
            more = f" and {n} more" if (n := len(known) - NAMES_SHOWN) > 0 else ""
            return (
                f"{name}={value}: {database.location_text} has no session of it; of"
                f" {name} it has {shown}{more}"
            )
    asked = " ".join(f"{name}={value}" for name, value in wanted.items())
    return (
        f"{database.location_text}: no session meets {asked or 'any condition'}; ask"
        " for fewer conditions, or run fieldcal batch on more sessions"
    )


def _print_lot(found: LotAnalysis) -> None:
    from fieldcal.calibration.wording import format_unit, format_with_sigma
    from fieldcal.commands.text_columns import text_columns
    from fieldcal.fleet.lot_yield import yield_sentence

    say = sys.stdout.write
    say(
        f"{len(found.units)} units with a good result; {found.sessions} sessions,"
        f" {found.failed} of them without a result\n"
        f"yield {yield_sentence(found)}\n\n"
    )
    rows = [["parameter", "mean ± of it", "spread (95 %)", "Cpk"]]
    for one in found.parameters.values():
        fit = one.distribution
        mean = " ± ".join(format_with_sigma(fit.mean, fit.mean_sigma))
        wide = f"{fit.spread:.2g} ({fit.low:.2g} to {fit.high:.2g})"
        unit = format_unit(one.unit)
        rows.append([one.name, mean, f"{wide} {unit}".rstrip(), one.cpk_text])
    for line in text_columns(rows):
        say(line + "\n")
    for line in lot_findings(found):
        say(line + "\n")


def lot_findings(found: LotAnalysis) -> list[str]:
    """Lines about odd units, shifts, and charts beyond their limits."""
    from fieldcal.calibration.wording import format_unit, format_with_sigma
    from fieldcal.fleet.lot import serials_sentence, untimed_sentence

    out = []
    for odd in found.odd[:ODD_UNITS_SHOWN]:
        unit = format_unit(found.parameters[odd.parameter].unit)
        off = " ± ".join(format_with_sigma(odd.deviation, odd.sigma))
        out.append(
            f"odd: {escape_line(odd.serial or odd.folder)}, {odd.parameter} is off by"
            f" {off} {unit}".rstrip()
        )
    if len(found.odd) > ODD_UNITS_SHOWN:
        out.append(f"odd: and {len(found.odd) - ODD_UNITS_SHOWN} more (--json)")
    for shift in found.shifts:
        unit = format_unit(found.parameters[shift.parameter].unit)
        groups = zip(shift.labels, shift.values, shift.sigmas, strict=True)
        told = "; ".join(
            f"{escape_line(label)} {' ± '.join(format_with_sigma(float(v), float(s)))}"
            f" {unit}"
            for label, v, s in groups
        )
        out.append(
            f"shifted by {shift.level}, P = {shift.probability:.2f}: {shift.parameter}:"
            f" {told}"
        )
    for alarm in found.alarms:
        out.append(
            f"drift: {alarm.parameter} leaves the {alarm.chart} chart at"
            f" {escape_line(alarm.at)}; its mean changes at about"
            f" {escape_line(alarm.since)}"
        )
    if alike := serials_sentence(found):
        out.append(escape_line(alike))
    if found.untimed:
        out.append(untimed_sentence(found))
    if found.in_control:
        out.append("in control: no odd unit, no shift, no drift")
    return out
