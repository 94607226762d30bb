"""`fieldcal compare`: compare two calibrations."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.sentences import degrees_of_freedom

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration, Comparison

EXAMPLE = """\
  fieldcal compare bench-7/2026-03-01 bench-7/2026-06-01
  fieldcal compare before.json after.json --json
  fieldcal compare --instances flight
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    what = "solved session folder, or its result.json; two, or with --instances more"
    add("paths", type=Path, nargs="+", metavar="SESSION", help=what)
    add(
        "--instances",
        action="store_true",
        help="compare the IMUs of one log with each other and with g: their session"
        " folders, or the folder that contains them; they need not be solved",
    )
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 1 if one of several instances disagrees."""
    from fieldcal.calibration import compare
    from fieldcal.core.errors import InputError

    if args.instances:
        return _compare_instances(args)
    if len(args.paths) != len(("first", "second")):
        raise InputError("name two calibrations, or several sessions with --instances")
    found = compare(*(read_calibration(path) for path in args.paths))
    if args.json:
        sys.stdout.write(json.dumps(comparison_document(found)) + "\n")
    else:
        sys.stdout.write(comparison_table(found))
    return 0


def _compare_instances(args: argparse.Namespace) -> int:
    """Compare the IMUs of one log with each other and with gravity."""
    from fieldcal.evaluation.instances import compare_instances
    from fieldcal.evaluation.usable_windows import usable_windows
    from fieldcal.session.folder import Session

    folders = _session_folders(args.paths)
    sessions = {
        name: Session.open(one)
        for name, one in zip(_instance_names(folders), folders, strict=True)
    }
    means = {
        name: np.array([a.mean[:3] for a in usable_windows(one).averages])
        for name, one in sessions.items()
    }
    found = compare_instances(means, next(iter(sessions.values())).gravity)
    if args.json:
        sys.stdout.write(json.dumps([one.document() for one in found]) + "\n")
    else:
        sys.stdout.write("".join(f"{one.sentence()}\n" for one in found))
    return int(any(one.out for one in found))


def _session_folders(paths: list[Path]) -> list[Path]:
    """Folders that are sessions, and the sessions in those that are not, each once.

    Raises
    ------
    InputError
        If there are fewer than two.

    """
    from fieldcal.core.errors import InputError
    from fieldcal.session.folder import DESCRIPTION

    found: list[Path] = []
    for path in paths:
        inner = sorted(p.parent for p in path.glob(f"*/{DESCRIPTION}"))
        found += [path] if (path / DESCRIPTION).exists() else inner
    found = list({path.resolve(): path for path in found}.values())
    if len(found) < len(("one", "other")):
        raise InputError(
            f"{' '.join(map(str, paths))}: holds"
            f" {len(found) or 'no'} session{'s' * (len(found) != 1)}; name the folder"
            " that fieldcal import wrote for a log of several IMUs, or its sessions"
        )
    return found


def _instance_names(folders: list[Path]) -> list[str]:
    """Names of the folders; their paths if two have the same name."""
    names = [path.resolve().name for path in folders]
    return names if len(set(names)) == len(names) else [str(path) for path in folders]


def read_calibration(path: Path) -> Calibration:
    """Read the calibration of a solved session folder or of a result.json.

    Raises
    ------
    InputError
        If there is no calibration, or it cannot be used, or the session has changed
        since.

    """
    from fieldcal.calibration import Calibration
    from fieldcal.core.documents import load_json
    from fieldcal.core.errors import InputError
    from fieldcal.session.folder import RESULT
    from fieldcal.session.result_source import outdated_text

    file = path / RESULT if path.is_dir() else path
    try:
        document = load_json(file.read_text("utf-8"))
    except FileNotFoundError:
        if file == path:
            raise InputError(
                f"{path}: is not there; name the folder of a session that was solved,"
                " or its result.json"
            ) from None
        raise InputError(f"{file} is not there: run fieldcal solve first") from None
    except (OSError, ValueError) as fault:
        raise InputError(
            f"{file}: is no calibration ({fault}); name the folder of a session that"
            " was solved, or its result.json"
        ) from None
    try:
        found = Calibration.from_json(document)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    if file.name == RESULT and (outdated := outdated_text(file.parent, document)):
        raise InputError(outdated)
    return found


def comparison_table(found: Comparison) -> str:
    """Text of a comparison, one line for each parameter."""
    from fieldcal.calibration.wording import format_with_sigma

    width = max(len(n) for n in found.names)
    lines = [f"{'parameter':{width}}  second - first      ± 1σ       difference/σ"]
    for name, d, s, z in zip(
        found.names, found.difference, found.sigma, found.z, strict=True
    ):
        value, sigma = format_with_sigma(-float(d), float(s))
        sigma = sigma if s > 0 else "0"
        # no ratio for what both know exactly: there is nothing to divide by
        ratio = f"{-z:z.1f}" if s > 0 else "exact"
        mark = "  changed" if name in found.changed else ""
        lines.append(f"{name:{width}}  {value:>14}  {sigma:>10}  {ratio:>12}{mark}")
    for which, names in (("first", found.only_first), ("second", found.only_second)):
        if names:
            lines.append(f"only in the {which}: {', '.join(names)}")
    lines.append(f"all together: {_together(found)}")
    return "\n".join(lines) + "\n"


def _together(found: Comparison) -> str:
    """Whether anything has changed, by all parameters."""
    if not np.isfinite(found.chi2):
        exact = (found.sigma == 0) & (found.difference != 0)
        names = [n for n, odd in zip(found.names, exact, strict=True) if odd]
        return f"changed, since both have {', '.join(names)} exactly, and not the same"
    if not found.dof:
        return "the same; neither calibration has an uncertainty"
    return (
        f"χ² = {found.chi2:.1f} with {degrees_of_freedom(found.dof)}, "
        f"probability {found.chance:.2g} if nothing has changed"
    )


def comparison_document(found: Comparison) -> dict[str, object]:
    """A comparison as one JSON object."""
    return {
        "names": list(found.names),
        "difference": [-float(d) for d in found.difference],
        "sigma": found.sigma.tolist(),
        "changed": list(found.changed),
        "chi2": found.chi2 if np.isfinite(found.chi2) else None,
        "dof": found.dof,
        "chance": found.chance,
        "only_first": list(found.only_first),
        "only_second": list(found.only_second),
    }
