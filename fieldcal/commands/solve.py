"""`fieldcal solve`: from a recorded session to a calibration with its uncertainty."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

EXAMPLE = """\
  fieldcal solve bench-7/2026-03-01
  fieldcal solve imu0 --cross --json > imu0.json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder")
    add("--json", action="store_true", help="print result.json instead of the table")
    add(
        "--method",
        default="auto",
        choices=("auto", "two_position", "five_position", "joint", "scalar"),
        help="auto (default) takes the best that the positions allow",
    )
    add(
        "--tilt",
        default="auto",
        choices=("auto", "none", "angle_offset", "base_tilt"),
        help="what a base that is not level does; auto (default) lets the data say",
    )
    add("--cross", action="store_true", help="cross-coupling (non-orthogonality) too")
    add(
        "--as-printed",
        action="store_true",
        help="follow the paper's print with its misprints, for comparison",
    )


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from dataclasses import replace

    from fieldcal.commands.table import show
    from fieldcal.observing import observe, with_provenance
    from fieldcal.session import RESULT, Session
    from fieldcal.solve import solve

    session = Session.open(args.session)
    seen, warnings = observe(session)
    found = solve(
        seen,
        method=args.method,
        tilt=args.tilt,
        cross=args.cross,
        as_printed=args.as_printed,
    )
    found = replace(found, warnings=(*warnings, *found.warnings))
    found = with_provenance(found, session.about)
    path = session.write_json(RESULT, found.to_json())
    if args.json:
        for warning in found.warnings:
            sys.stderr.write(f"fieldcal solve: {warning}\n")
        sys.stdout.write(json.dumps(found.to_json()) + "\n")
    else:
        show(found)
        sys.stdout.write(f"written: {path}\n")
    return 0 if found.good else 1
