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

GROUPS = 6
"""Groups of an effect that are shown; --json has all."""


def run(args: argparse.Namespace) -> int:
    """Carry out the command: 0 nothing is shared, 1 something is left out."""
    from fieldcal.fleet.shared import SharedSearch

    if args.twin or args.against or args.report:
        raise InputError("--shared goes without --twin, --against and --report")
    sessions = _reduced(args)
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
        for line in lines(one):
            say(line + "\n")
    return 1 if found else 0


def _reduced(args: argparse.Namespace) -> list[StoredSession]:
    """The sessions with their reduced rows; those not in the store yet are solved.

    Raises
    ------
    InputError
        Naming the session that cannot be solved.

    """
    from fieldcal.commands.batch import carried_out, pool_of
    from fieldcal.fleet.batch import SessionBatch
    from fieldcal.fleet.outcome import SessionTask
    from fieldcal.fleet.tree import sessions_in
    from fieldcal.history.database import Database
    from fieldcal.history.location import default_location

    folders = sessions_in(args.sessions)
    database = Database(args.history or default_location())
    plain, diagnosed = (
        SessionBatch(folders, SessionTask(d), database) for d in (False, True)
    )
    known = set(diagnosed.unprocessed())
    left = [folder for folder in plain.unprocessed() if folder in known]
    if left:
        with pool_of(args) as pool:
            carried_out(plain, left, pool)
    rows = [one for some in plain.stored_rows() for one in some]
    for one in rows:
        if one.error:
            raise InputError(f"{one.error}; or leave {Path(one.folder).name} out")
    return rows


def lines(one: SharedFinding) -> list[str]:
    """What is said of an effect: its level, and its values in the groups that show it.

    Groups are in the order of what they show, by the largest value in its sigmas.
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
    for g in order[:GROUPS]:
        told = []
        rows = zip(one.effect.columns, one.values[g], one.sigmas[g], strict=True)
        for column, value, sigma in rows:
            shown = " ± ".join(format_with_sigma(float(value), float(sigma)))
            told.append(f"{column.name} {shown} {format_unit(column.unit)}".rstrip())
        out.append(f"  {escape_line(groups[g])}: {'; '.join(told)}")
    if len(groups) > GROUPS:
        out.append(f"  and {len(groups) - GROUPS} more, which show less (--json)")
    return out
