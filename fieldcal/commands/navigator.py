"""`fieldcal navigator`: calibrate an INS from the drift of its solution at rest."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

EXAMPLE = """\
  fieldcal navigator bench-7/drift
  fieldcal navigator bench-7/drift --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    what = "folder with session.toml and the navigator's solution.csv"
    parser.add_argument("session", type=Path, metavar="SESSION", help=what)
    parser.add_argument("--json", action="store_true", help="print result.json")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.table import show_calibration
    from fieldcal.navigator.session_runs import calibrate_navigator
    from fieldcal.session import description_file
    from fieldcal.session.file_writing import write_atomically
    from fieldcal.session.folder import DESCRIPTION, RESULT
    from fieldcal.session.result_source import with_source

    about = description_file.read_description(args.session / DESCRIPTION)
    found = with_source(calibrate_navigator(args.session, about), args.session)
    text = json.dumps(found.to_json(), allow_nan=False)
    path = write_atomically(args.session / RESULT, text + "\n")
    if args.json:
        for warning in found.warnings:
            sys.stderr.write(f"fieldcal navigator: {warning}\n")
        sys.stdout.write(text + "\n")
    else:
        show_calibration(found)
        sys.stdout.write(f"written: {path}\n")
    return 0
