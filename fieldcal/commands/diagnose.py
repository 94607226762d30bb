"""`fieldcal diagnose`: find which effects the simulation leaves out."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.commands.keep_result import keep_result
from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.diagnosis import Diagnosis
    from fieldcal.diagnosis.explain import Explanation
    from fieldcal.session.folder import Session
    from fieldcal.twin import ReplayResult

HELP = "say what physics the simulation leaves out of a recording"

RARE = ("motion", "rounds", "limit", "junit", "jobs", "history")

EXAMPLE = """\
  fieldcal diagnose bench-7/2026-03-01
  fieldcal diagnose bench-7/2026-03-01 --details
  fieldcal diagnose bench-7/2026-03-01 --json > diagnosis.json
  fieldcal diagnose bench-7/2026-03-01 --twin bench-7.toml
  fieldcal sim --profile bench-7.toml
  fieldcal diagnose bench-7/2026-03-01 --against sitl.bin --patch sitl
  fieldcal diagnose bench-7/2026-* --shared
  fieldcal diagnose bench-7/2026-03-01 --against "./simulate {patch} {out}"
"""

DIAGNOSIS = "diagnosis.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("sessions", type=Path, nargs="+", metavar="SESSION", help="session folder")
    add(
        "--shared",
        action="store_true",
        help="find effects that several sessions share, and whether they belong to"
        " the device, lot, station or session",
    )
    add("--jobs", type=int, metavar="N", help="with --shared: number of processes")
    add("--history", metavar="FILE", help="with --shared: use this store")
    add("--json", action="store_true", help="print diagnosis.json instead of the view")
    add("--details", action="store_true", help="print all numbers")
    add("--report", action="store_true", help="also write report.html")
    add(
        "--twin",
        type=Path,
        metavar="FILE",
        help="write a virtual device with the effects found, for fieldcal sim"
        " --profile FILE, and replay the session on it",
    )
    _add_comparison_options(parser)


def _add_comparison_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of a comparison with a simulator."""
    add = parser.add_argument
    add(
        "--against",
        metavar="SIM",
        help="compare with the output of a simulator for the same positions or motion:"
        " a session folder, or a file that import reads; or a command with {patch} and"
        " {out}, which is run, patched and run again",
    )
    add(
        "--motion",
        action="store_true",
        help="with --against: compare moment by moment, if SIM follows the motion of"
        " the recording (default if fewer than three positions are held)",
    )
    add(
        "--patch",
        choices=("gazebo", "json", "kalibr", "px4", "sitl", "toml"),
        help="with --against: write the differences in the simulator's own terms",
    )
    add(
        "--rounds",
        type=int,
        default=3,
        metavar="N",
        help="largest number of patches of a command (default: 3)",
    )
    add(
        "--limit",
        action="append",
        default=[],
        metavar="ID=SIZE",
        help="with --against: tolerated difference, such as acc_bias=0.02 or noise=10%%"
        "; within it the exit code is 0",
    )
    add(
        "--junit",
        type=Path,
        metavar="FILE",
        help="with --against: write the comparison as JUnit XML",
    )


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 0 if consistent, 1 for any other verdict."""
    if args.shared:
        from fieldcal.commands import shared

        return shared.run(args)
    if len(args.sessions) > 1:
        raise InputError("several sessions need --shared; or diagnose one at a time")
    (args.session,) = args.sessions
    if args.against:
        from fieldcal.commands import against

        if args.twin:
            raise InputError("name --twin or --against: each is an answer of its own")
        return against.run(args)
    if args.patch or args.limit or args.junit or args.motion:
        raise InputError(
            "--motion, --patch, --limit and --junit need --against: name a simulator"
        )
    if args.twin and not args.twin.parent.is_dir():
        raise InputError(
            f"{args.twin} cannot be written: there is no folder {args.twin.parent};"
            " create it, or name another file"
        )
    return _diagnose_session(args)


def _diagnose_session(args: argparse.Namespace) -> int:
    """Diagnose one session and write the diagnosis."""
    from fieldcal.commands.progress import SEARCH, show_work
    from fieldcal.diagnosis.explain import explain
    from fieldcal.diagnosis.prepare import prepare_recording
    from fieldcal.diagnosis.verdict import make_diagnosis
    from fieldcal.run.untaken import untaken_sentence
    from fieldcal.session.folder import Session

    session = Session.open(args.session)
    with show_work(args, f"{SEARCH} {args.session}"):
        explanation = explain(prepare_recording(session.block, session.about))
        found = make_diagnosis(session.block, explanation)
    again = None
    if args.twin:
        with show_work(args, f"replaying {args.session} on its twin"):
            again = _replay_on_twin(args.twin, session, explanation, found)
    if again is not None:
        found = replace(found, says=f"{found.says} {again.says}")
    if lacking := untaken_sentence(session):
        found = replace(found, warnings=(*found.warnings, lacking))
    content = found.to_json()
    if again is not None:
        content["twin"] = again.to_json(str(args.twin))
    for warning in (*session.warnings, *found.warnings):
        sys.stderr.write(f"fieldcal diagnose: {warning}\n")
    if args.json:
        sys.stdout.write(json.dumps(content, allow_nan=False) + "\n")
    else:
        from fieldcal.commands.diagnosis_view import show_diagnosis

        show_diagnosis(found, again, details=args.details)
    path = keep_result(session, DIAGNOSIS, content)
    if not args.json:
        sys.stdout.write(f"written: {path}\n")
    if args.report:
        from fieldcal.commands.report import write_report

        page = write_report(args.session)
        (sys.stderr if args.json else sys.stdout).write(f"written: {page}\n")
    if args.twin and not args.json:
        sys.stdout.write(f"written: {args.twin}\n")
    return 0 if found.verdict == "consistent" else 1


def _replay_on_twin(
    path: Path, session: Session, explanation: Explanation, found: Diagnosis
) -> ReplayResult:
    """Replay the session on its twin, and write the twin's device file."""
    from fieldcal.diagnosis.findings.quality import fit_recorded_samples
    from fieldcal.session.file_writing import write_atomically
    from fieldcal.sim_device.profile_file import to_toml
    from fieldcal.twin import replay_session

    again = replay_session(
        explanation, found, fit_recorded_samples(session.block, explanation)
    )
    write_atomically(path, to_toml(again.profile))
    return again
