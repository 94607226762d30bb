"""`fieldcal diagnose`: what physics the simulation leaves out of a recording."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

HELP = "say what physics the simulation leaves out of a recording"

EXAMPLE = """\
  fieldcal diagnose bench-7/2026-03-01
  fieldcal diagnose bench-7/2026-03-01 --json > diagnosis.json
"""

DIAGNOSIS = "diagnosis.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder")
    add("--json", action="store_true", help="print diagnosis.json instead of the view")
    add("--report", action="store_true", help="write report.html as well")


def run(args: argparse.Namespace) -> int:
    """Carry out the command: 0 consistent, 1 something is left out or unexplained."""
    # small matrices by the thousand: threads would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from fieldcal.diagnosis import diagnose
    from fieldcal.session import Session

    session = Session.open(args.session)
    found = diagnose(session.block, session.about)
    content = found.to_json()
    path = session.write_json(DIAGNOSIS, content)
    for warning in (*session.warnings, *found.warnings):
        sys.stderr.write(f"fieldcal diagnose: {warning}\n")
    if args.json:
        sys.stdout.write(json.dumps(content, allow_nan=False) + "\n")
    else:
        from fieldcal.commands.diagnosis_view import show

        show(found)
        sys.stdout.write(f"written: {path}\n")
    if args.report:
        from fieldcal.commands.report import write

        page = write(args.session)
        (sys.stderr if args.json else sys.stdout).write(f"written: {page}\n")
    return 0 if found.verdict == "consistent" else 1
