"""`--against` of `fieldcal diagnose`: hold a recording against a simulator."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fieldcal.against import Match

AGAINST = "against.json"


def run(args: argparse.Namespace) -> int:
    """Carry out the comparison: 0 if the two agree, 1 if they differ."""
    from fieldcal.against import matched
    from fieldcal.against.opening import opened
    from fieldcal.against.side import side
    from fieldcal.session.folder import Session

    session = Session.open(args.session)
    real = session.block, session.about
    block, about, said = opened(Path(args.against), real)
    one = side(str(args.session), *real)
    found = matched(one, side(str(args.against), block, about, one))
    path = session.write_json(AGAINST, found.to_json() | {"against": args.against})
    for warning in (*session.warnings, *said, *found.warnings):
        sys.stderr.write(f"fieldcal diagnose: {warning}\n")
    _say(args, found)
    if not args.json:
        sys.stdout.write(f"written: {path}\n")
    if args.report:
        from fieldcal.commands.report import write

        page = write(args.session)
        (sys.stderr if args.json else sys.stdout).write(f"written: {page}\n")
    return 0 if found.verdict == "consistent" else 1


def _say(args: argparse.Namespace, found: Match) -> None:
    """Show what was found, as it was asked for."""
    if args.json:
        sys.stdout.write(json.dumps(found.to_json(), allow_nan=False) + "\n")
        return
    from fieldcal.commands.against_view import show

    show(found, details=args.details)
