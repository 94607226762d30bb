"""What a run is to do, from its options, a plan file or a session broken off."""

from __future__ import annotations

import argparse
import shlex
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.site import given_tables, overlay, site_tables
from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.run.plan_file import PlanTask

SESSIONS = Path("sessions")
"""Where runs are recorded that name no folder."""

EXACT_DEG = 0.001
"""How well a virtual fixture sets its angles, deg: as it turns them, to rounding."""

VIRTUAL_DEG = 45.0
"""Latitude that a virtual device is told where nobody says one."""

OFF = "angle"
"""What is in the name of every effect that makes it stand elsewhere."""


def make_task(args: argparse.Namespace) -> tuple[PlanTask, Path]:
    """What is to be done, and the folder it is recorded into.

    Raises
    ------
    InputError
        Naming what is wrong with the plan.

    """
    from fieldcal import procedures
    from fieldcal.run import plan_file

    if args.resume:
        return _resumed(args)
    if not args.procedure:
        raise InputError(
            f"name a procedure ({', '.join(procedures.procedure_names())})"
            " or a plan file"
        )
    if args.procedure in procedures.procedure_names():
        name, tables = "the options", _tables_of_options(args)
    else:
        name, tables = args.procedure, _tables_of_file(args)
    task = plan_file.task_from_tables(_stood(overlay(tables, _site(args))), name)
    stamp = datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    return task, args.output or SESSIONS / f"{stamp}-{task.procedure}"


def _resumed(args: argparse.Namespace) -> tuple[PlanTask, Path]:
    from fieldcal.run import plan_file
    from fieldcal.run.session_run import open_for_resume

    if args.procedure or args.output:
        raise InputError("--resume goes on with what it finds: give it alone")
    if given_tables(args):
        raise InputError(
            "--resume goes on with the device and place its session.toml names:"
            " leave those options out"
        )
    session, tables, args.again = open_for_resume(_newest(args.resume))
    tables["run"] = {**tables["run"], **_given(args)}
    tables = overlay(tables, _site(args))
    return plan_file.task_from_tables(
        tables, f"{session.folder}/session.toml"
    ), session.folder


def _newest(folder: Path) -> Path:
    """The session that was named, or the one last written to in the folder of all."""
    from fieldcal.session.marks import MARKS

    if folder != SESSIONS:
        return folder
    marks = max(
        folder.glob(f"*/{MARKS}"), key=lambda f: f.stat().st_mtime, default=None
    )
    return marks.parent if marks else folder


def _tables_of_options(args: argparse.Namespace) -> dict[str, Any]:
    from fieldcal.run import plan_file
    from fieldcal.session import description

    tables = {"format": description.FORMAT_VERSION, **site_tables(args, "device")}
    tables["position"] = plan_file.positions_of(args.procedure)
    tables["run"] = {"procedure": args.procedure, **_given(args)}
    return tables


def _tables_of_file(args: argparse.Namespace) -> dict[str, Any]:
    from fieldcal.run import plan_file

    tables = plan_file.read(Path(args.procedure))
    if not isinstance(tables.get("run", {}), dict):
        raise InputError(f"{args.procedure}: run must be a table: write [run]")
    tables = overlay(tables, given_tables(args))
    tables["run"] = {**tables.get("run", {}), **_given(args)}
    return tables


def _site(args: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """How level and steady the base is, how well angles are set, as options say it.

    A virtual fixture stands where it is told, unless it is to be off.
    """
    angles = args.angles
    if angles is None and args.virtual is not None and OFF not in args.virtual:
        angles = EXACT_DEG
    said = {
        "level_deg": args.level,
        "angle_setting_deg": angles,
        "angles_from": args.angles_from,
        "sways": args.sways,
    }
    site = {key: value for key, value in said.items() if value is not None}
    return {"site": site} if site else {}


def _stood(tables: dict[str, Any]) -> dict[str, Any]:
    """With the place of a virtual device, which stands where it is told."""
    run, site = tables.get("run"), tables.get("site", {})
    mover = run.get("mover") if isinstance(run, dict) else None
    if not isinstance(mover, dict) or mover.get("kind") != "virtual":
        return tables
    if "control" in mover or not isinstance(site, dict):
        return tables
    if any(word in str(mover.get("options")) for word in ("--latitude", "--gravity")):
        return tables
    return {**tables, "site": {"latitude_deg": VIRTUAL_DEG, **site}}


def _given(args: argparse.Namespace) -> dict[str, Any]:
    """The table [run] as far as options say it."""
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
