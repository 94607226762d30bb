"""`fieldcal verify`: check every file of a session against its checksum."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

EXAMPLE = """\
  fieldcal verify bench-7/2026-03-01
  fieldcal verify bench-7/2026-03-01 --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("session", type=Path, metavar="SESSION", help="session folder")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 1 if anything is wrong."""
    from fieldcal.session.integrity import file_faults

    found = list(file_faults(args.session))
    if args.json:
        listed = [{"file": f.file, "text": f.text} for f in found]
        sys.stdout.write(json.dumps({"whole": not found, "findings": listed}) + "\n")
        return 1 if found else 0
    for finding in found:
        sys.stdout.write(f"{finding.file}: {finding.text}\n")
    if not found:
        sys.stdout.write(f"{args.session}: whole\n")
    return 1 if found else 0
