"""`fieldcal undo`: restore the previous calibration of an autopilot."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

EXAMPLE = """\
  fieldcal undo bench-7/2026-03-01
  fieldcal undo bench-7/2026-03-01 --device mavlink:udp:0.0.0.0:14550 --yes
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "session",
        type=Path,
        metavar="SESSION",
        help="session that was written, or its installed-before file",
    )
    add("--device", metavar="URL", help="default: the one that was written to")
    add("--yes", action="store_true", help="do not ask")
    add("--force", action="store_true", help="restore even if parameters changed since")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.autopilot import check_ready, confirm, open_parameters
    from fieldcal.install.transaction import (
        WriteRolledBack,
        adding_to_fault,
        broken_off,
        check_unchanged,
        install,
        last_saved,
        note_done,
        whole,
    )

    path, known = last_saved(args.session)
    old, new = known["old"], known["new"]
    device = args.device or known["device"]
    with open_parameters(device) as link:
        check_ready(link, link.autopilot)
        if known["done"] and not args.force:
            check_unchanged(link, new, "when it was written", old)
        now = link.read(old)
        if said := broken_off(now, old, new):
            sys.stderr.write(f"{said}\n")
        for name, value in old.items():
            unit = _offset_unit(name)
            sys.stdout.write(f"{name}: {now[name]:.9g} -> {value:.9g}{unit}\n")
        confirm(f"give these {len(old)} parameters back to {device}", args.yes)
        with adding_to_fault("nothing was given back to the autopilot"):
            note_done(path, done=False)  # from here on it may be interrupted
        back = now if whole(now, new) else {**now, **new}
        try:
            install(link, back, old, "as they were written")
        except WriteRolledBack:
            note_done(path, done=True)
            raise
    with adding_to_fault(
        f"all {len(old)} parameters are given back and read back, which could not be"
        " noted"
    ):
        note_done(path, undone=True)
    sys.stderr.write(f"given back and read back: {len(old)} parameters\n")
    return 0


def _offset_unit(name: str) -> str:
    """Unit of an offset of an autopilot, behind a space; empty for other parameters.

    >>> [_offset_unit(n) for n in ("INS_ACCOFFS_X", "CAL_GYRO0_XOFF", "INS_ACCSCAL_X")]
    [' m/s²', ' rad/s', '']
    """
    if "OFF" not in name:
        return ""
    return " m/s²" if "ACC" in name else " rad/s"
