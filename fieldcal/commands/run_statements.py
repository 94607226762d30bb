"""What `run --resume` states of device and place that the session leaves open.

An operator who forgot the latitude, or how well the angles are set, is told so by the
decision, when everything has been recorded. The session is then judged with what is
stated now, which is written into its session.toml: each command that reads it later,
and each further position, is to know the same.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.site import merge_tables, tables_of_options
from fieldcal.core.errors import InputError, SessionError, disk_says

if TYPE_CHECKING:
    from fieldcal.session.folder import Session

PLACE = ("latitude_deg", "height_m", "gravity")
"""Keys of [site] of which a height alone states nothing."""

STATED_AT_ANY_TIME = ("level_deg", "angle_setting_deg", "angles_from", "sways")
"""Keys of [site] that may be stated anew: how well the base and the angles were set."""


def site_options(args: argparse.Namespace) -> dict[str, Any]:
    """Keys of [site] of the options on level, swaying base and angle setting."""
    said = (args.level, args.angles, args.angles_from, args.sways)
    keys = zip(STATED_AT_ANY_TIME, said, strict=True)
    return {key: value for key, value in keys if value is not None}


def write_statements(args: argparse.Namespace, folder: Path) -> bool:
    """Write what the options state into session.toml; whether they state anything.

    Raises
    ------
    InputError
        If the session states another value already, or a value is impossible.
    SessionError
        If it is none, is being recorded, or cannot be written.

    """
    from fieldcal.session.folder import Session

    given = merge_tables(tables_of_options(args), {"site": site_options(args)})
    given = {name: table for name, table in given.items() if table}
    if not given:
        return False
    session = Session.open(folder)
    _refuse_contradiction(session.about.raw, given, folder)
    try:
        _write(session, given)
    except OSError as error:
        raise SessionError(
            f"{folder}: cannot be written: {disk_says(error)}"
        ) from error
    return True


def _refuse_contradiction(
    stated: Mapping[str, Any], given: Mapping[str, Mapping[str, Any]], folder: Path
) -> None:
    """Refuse another value than the session was recorded with."""
    site = stated.get("site", {})
    placed = "latitude_deg" in site or "gravity" in site
    for table, values in given.items():
        for key, value in values.items():
            free = key in STATED_AT_ANY_TIME or (key in PLACE and not placed)
            known = stated.get(table, {}).get(key)
            if not (free or known in (None, value)):
                raise InputError(
                    f"--resume goes on with the device and place that {folder} has, and"
                    f" its session.toml states [{table}] {key} = {known}: leave those"
                    " options out, or begin a new run"
                )


def _write(session: Session, given: Mapping[str, Mapping[str, Any]]) -> None:
    """Set keys in the session.toml of a session and of the devices beside it."""
    import tomlkit

    from fieldcal.run.companions import companion_folders
    from fieldcal.session.description_file import parse_description
    from fieldcal.session.file_writing import write_atomically
    from fieldcal.session.folder import DESCRIPTION
    from fieldcal.session.lock import SessionLock

    parse_description(merge_tables(session.about.raw, given))  # refuses what cannot be
    further = len(session.about.raw.get("run", {}).get("further", ()))
    lock = SessionLock(session.folder)
    try:
        for folder in (session.folder, *companion_folders(session.folder, further)):
            file = folder / DESCRIPTION
            if not file.exists():
                continue
            tables = tomlkit.parse(file.read_text("utf-8"))
            own = given if folder == session.folder else {"site": given.get("site", {})}
            for name, values in own.items():
                tables.setdefault(name, tomlkit.table()).update(values)
            write_atomically(file, tomlkit.dumps(tables))
    finally:
        lock.release()


def decide_as_stated(args: argparse.Namespace, folder: Path) -> int | None:
    """Judge a finished session anew, with what is stated now; the exit code.

    None if it is to be gone on with: it is not finished, or positions would help.
    """
    from fieldcal.calibration import limits
    from fieldcal.commands import run_view
    from fieldcal.commands.progress import SEARCH, show_work
    from fieldcal.commands.run_results import solve_and_decide
    from fieldcal.core.documents import load_json
    from fieldcal.history.location import default_location
    from fieldcal.history.store import History
    from fieldcal.run.resuming import is_decided, positions_left_out
    from fieldcal.session.folder import RESULT, Session

    session = Session.open(folder)
    if not is_decided(session):
        return None
    file = args.limits or session.about.raw.get("run", {}).get("limits")
    bounds = limits.read(session.about.grade, Path(file) if file else None)
    history = History(args.history or default_location())
    before = load_json((folder / RESULT).read_text("utf-8"))
    method = str(before.get("method", "auto"))
    with show_work(args, f"{SEARCH} {folder}"):
        found = solve_and_decide(session, bounds, history, method)
    go = run_view.is_go(found)
    if not go and (found.info["decision"].get("remedy") or positions_left_out(session)):
        return None
    if args.json:
        run_view.show_json(found, None, {})
    else:
        run_view.show_results(found, folder, None, {})
    if not args.no_report:
        run_view.try_write_report(folder, history.place)
    if not args.json:
        run_view.show_decisions(found, {}, folder)
    return 0 if go else 1
