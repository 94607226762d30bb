"""The task of a run, from options, a plan file or an interrupted session."""

from __future__ import annotations

import argparse
import shlex
import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.run_statements import site_options
from fieldcal.commands.site import merge_tables, site_tables, tables_of_options
from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.run.plan_file import PlanTask

SESSIONS = Path("sessions")
"""Folder of the sessions of runs without --output."""

VIRTUAL_SETTING_DEG = 0.001
"""Uncertainty of the angles of a virtual fixture, deg: exact but for rounding."""

VIRTUAL_LATITUDE_DEG = 45.0
"""Latitude of a virtual device unless one is stated, deg."""

ANGLE_EFFECT = "angle"
"""Part of the name of every effect that changes a virtual device's angles."""


def make_task(args: argparse.Namespace) -> tuple[PlanTask, Path]:
    """The task of a run, and the folder it is recorded into.

    Raises
    ------
    InputError
        If the plan is invalid; the message says why.

    """
    from fieldcal import procedures
    from fieldcal.run import plan_file

    if args.resume:
        return _task_to_resume(args)
    if not args.procedure:
        raise InputError(
            f"name a procedure ({', '.join(procedures.procedure_names())})"
            " or a plan file"
        )
    if args.procedure in procedures.procedure_names():
        name, tables = "the options", _tables_of_options(args)
    else:
        name, tables = args.procedure, _tables_of_file(args)
    task = plan_file.task_from_tables(
        _with_virtual_latitude(merge_tables(tables, _site_options(args))), name
    )
    stamp = datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    return task, args.output or SESSIONS / f"{stamp}-{task.procedure}"


def make_room(folder: Path, headless: bool) -> None:
    """Move an earlier run that took no position out of a new one's folder."""
    from fieldcal.run.begun_before import set_untaken_aside
    from fieldcal.run.operator.script import report_event

    if aside := set_untaken_aside(folder):
        said = f"an earlier run that took no position is now in {aside}"
        if headless:
            report_event("tell", text=said)
        else:
            sys.stderr.write(f"{said}\n")


def _task_to_resume(args: argparse.Namespace) -> tuple[PlanTask, Path]:
    from fieldcal.run import plan_file
    from fieldcal.run.resuming import open_for_resume

    if args.procedure or args.output:
        raise InputError("--resume goes on with what it finds: give it alone")
    session, tables, args.again = open_for_resume(session_to_resume(args.resume))
    tables["run"] = {**tables["run"], **_run_options(args)}
    return plan_file.task_from_tables(
        tables, f"{session.folder}/session.toml"
    ), session.folder


def session_to_resume(folder: Path) -> Path:
    """The session that was named, or the latest one in `SESSIONS`.

    Raises
    ------
    InputError
        If none was named, and none is there.

    """
    from fieldcal.session.marks import MARKS

    if folder != SESSIONS or (folder / MARKS).exists():
        return folder
    marks = max(
        folder.glob(f"*/{MARKS}"), key=lambda f: f.stat().st_mtime, default=None
    )
    if marks is None:
        raise InputError(
            f"no run is in {SESSIONS}, where runs without -o are recorded: name the"
            " folder of the run, as in fieldcal run --resume FOLDER"
        )
    return marks.parent


def _tables_of_options(args: argparse.Namespace) -> dict[str, Any]:
    from fieldcal.run import plan_file
    from fieldcal.session import description_file

    tables = {"format": description_file.FORMAT_VERSION, **site_tables(args, "device")}
    tables["position"] = plan_file.default_positions(args.procedure)
    tables["run"] = {"procedure": args.procedure, **_run_options(args)}
    return tables


def _tables_of_file(args: argparse.Namespace) -> dict[str, Any]:
    from fieldcal.run import plan_file

    tables = plan_file.read_plan(Path(args.procedure))
    if not isinstance(tables.get("run", {}), dict):
        raise InputError(f"{args.procedure}: run must be a table: write [run]")
    tables = merge_tables(tables, tables_of_options(args))
    tables["run"] = {**tables.get("run", {}), **_run_options(args)}
    return tables


def _site_options(args: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Table [site] of the options on level, swaying base and angle setting.

    The angles of a virtual fixture are exact unless an effect changes them.
    """
    angles = args.angles
    if angles is None and args.virtual is not None and ANGLE_EFFECT not in args.virtual:
        angles = VIRTUAL_SETTING_DEG
    site = site_options(args)
    if angles is not None:
        site["angle_setting_deg"] = angles
    return {"site": site} if site else {}


def _with_virtual_latitude(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables, with a latitude for a virtual device that has none."""
    run, site = tables.get("run"), tables.get("site", {})
    mover = run.get("mover") if isinstance(run, dict) else None
    if not isinstance(mover, dict) or mover.get("kind") != "virtual":
        return tables
    if "control" in mover or not isinstance(site, dict):
        return tables
    if any(word in str(mover.get("options")) for word in ("--latitude", "--gravity")):
        return tables
    return {**tables, "site": {"latitude_deg": VIRTUAL_LATITUDE_DEG, **site}}


def _run_options(args: argparse.Namespace) -> dict[str, Any]:
    """Table [run] of the options that were given."""
    given: dict[str, Any] = {
        "device": args.device,
        "further": args.further_device or None,
        "further_serial": args.further_serial or None,
        "seconds": args.seconds,
        "sigma": args.sigma,
        "verify": args.verify or None,
        "limits": str(args.limits.absolute()) if args.limits else None,
    }
    if args.virtual is not None:
        speed = ["--speed", args.speed, "--seed", args.seed]
        options = f"{shlex.join(speed)} {args.virtual}".strip()
        given["mover"] = {"kind": "virtual", "options": options}
    return {key: value for key, value in given.items() if value is not None}
