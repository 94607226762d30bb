"""`--shared` of `fieldcal diagnose`: what several sessions have in common."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_line

if TYPE_CHECKING:
    from fieldcal.fleet.shared import SharedFinding
    from fieldcal.history.sessions import StoredSession

GROUPS_SHOWN = 6
"""Number of groups of an effect that are shown; --json has all."""


def run(args: argparse.Namespace) -> int:
    """Carry out the command; 0 if no effect is shared, else 1."""
    from fieldcal.fleet.shared import SharedSearch

    if args.twin or args.against or args.report:
        raise InputError("--shared goes without --twin, --against and --report")
    sessions = _sessions_with_rows(args)
    if len(sessions) < 2:
        raise InputError("--shared needs two sessions at least")
    search = SharedSearch(sessions)
    found = search.run()
    levels = [list(level.names) for level in search.groupings]
    if args.json:
        document: dict[str, Any] = {
            "sessions": [one.folder for one in sessions],
            "levels": levels,
            "effects": [one.to_json() for one in found],
        }
        sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
        return 1 if found else 0
    say = sys.stdout.write
    named = "; ".join(" or ".join(level) for level in levels)
    say(f"{len(sessions)} sessions; levels that they can tell apart: {named}\n")
    if not found:
        say("nothing is shared that a calibration leaves out\n")
    for one in found:
        for line in finding_lines(one):
            say(line + "\n")
    return 1 if found else 0


def _sessions_with_rows(args: argparse.Namespace) -> list[StoredSession]:
    """The sessions with their rows; those not in the store yet are solved first.

    Raises
    ------
    InputError
        If a session cannot be solved.

    """
    from fieldcal.commands.batch import worker_pool
    from fieldcal.commands.progress import process_with_progress
    from fieldcal.fleet.batch import SessionBatch
    from fieldcal.fleet.outcome import SessionTask
    from fieldcal.fleet.tree import sessions_in
    from fieldcal.history.database import Database
    from fieldcal.history.location import default_location
    from fieldcal.history.repeats import copy_sentence
    from fieldcal.history.sessions import without_repeats

    folders = sessions_in(args.sessions)
    database = Database(args.history or default_location())
    plain, diagnosed = (
        SessionBatch(folders, SessionTask(d), database) for d in (False, True)
    )
    known = set(diagnosed.unprocessed())
    left = [folder for folder in plain.unprocessed() if folder in known]
    if left:
        with worker_pool(args) as pool:
            process_with_progress(plain, left, pool)
    rows = [one for some in plain.stored_rows() for one in some]
    for one in rows:
        if one.error:
            raise InputError(f"{one.error}; or leave {Path(one.folder).name} out")
    rows, repeats = without_repeats(rows)
    for one, other in repeats:
        said = (
            f"{escape_line(one.folder)}: has the samples of"
            f" {escape_line(other.folder)}, and is left out"
        )
        if one.part and other.part and one.part.digest != other.part.digest:
            said = copy_sentence(one.folder, other.folder)
        sys.stderr.write(f"fieldcal diagnose: {said}\n")
    return rows


def finding_lines(one: SharedFinding) -> list[str]:
    """Lines about an effect: its level, and its values in the groups.

    Groups are ordered by their largest value in units of its sigma.
    """
    from fieldcal.calibration.wording import format_unit, format_with_sigma

    name, part = one.effect.key
    shape = f", {one.effect.shape}" if one.effect.shape else ""
    title = f"{name}{f' ({part}{shape})' if part or shape else ''}"
    out = [
        f"{title}: by {one.level}, P = {one.level_probability:.2f}"
        f" (of any level {one.probability:.2f})"
    ]
    if one.alternatives:
        out.append(f"  or, as well: {', '.join(one.alternatives)}")
    groups = one.effect.level_effect.grouping.labels
    order = np.argsort(-np.abs(one.values / one.sigmas).max(axis=1), kind="stable")
    for g in order[:GROUPS_SHOWN]:
        told = []
        rows = zip(one.effect.columns, one.values[g], one.sigmas[g], strict=True)
        for column, value, sigma in rows:
            shown = " ± ".join(format_with_sigma(float(value), float(sigma)))
            told.append(f"{column.name} {shown} {format_unit(column.unit)}".rstrip())
        out.append(f"  {escape_line(groups[g])}: {'; '.join(told)}")
    if len(groups) > GROUPS_SHOWN:
        out.append(f"  and {len(groups) - GROUPS_SHOWN} more, which show less (--json)")
    return out
