"""`fieldcal run`: take a device through a procedure, at the console or headless."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.further import Devices
from fieldcal.commands.site import add_site, site_tables
from fieldcal.errors import FieldcalError, InputError, PlanError

if TYPE_CHECKING:
    from fieldcal.beside import Beside
    from fieldcal.calibration import Calibration
    from fieldcal.description import Description
    from fieldcal.driver import Driver
    from fieldcal.movers import Mover
    from fieldcal.view import Operator

PROCEDURES = ("two_position", "five_position", "positions")

EXAMPLE = """\
  fieldcal run five_position --device "serial:/dev/ttyUSB0?format=witmotion"
  fieldcal run five_position --virtual --speed 20
  fieldcal run plan.toml --headless --json > result.json
"""

VIRTUAL_FORMAT = "witmotion"

GIVE_UP = 90.0
"""Device time after which a script gives a position up, s."""


@dataclass(frozen=True, slots=True)
class Task:
    """What is to be done: the tables of a session.toml, and how to carry them out."""

    procedure: str
    tables: Mapping[str, Any]
    about: Description
    seconds: float
    sigma: float | None
    device: str | None
    folder: Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "procedure",
        metavar="PROCEDURE",
        help=f"{', '.join(PROCEDURES)}, or a plan file (a session.toml with positions,"
        " and a table [run] of procedure, seconds, sigma, device)",
    )
    add(
        "--device",
        action=Devices,
        metavar="URL",
        help='such as "serial:/dev/ttyUSB0?format=witmotion"; again for each further'
        " device that turns with the first",
    )
    parser.set_defaults(further=[])
    add(
        "--virtual",
        nargs=argparse.OPTIONAL,
        const="",
        metavar="OPTIONS",
        help="against a virtual device; OPTIONS of fieldcal sim in one string",
    )
    add("--speed", default="1", metavar="X", help="of the virtual device's time")
    add("--seed", default="1", metavar="N", help="of the virtual device's noise")
    add("--seconds", type=float, metavar="S", help="averaging time (default: 30)")
    add("--sigma", type=float, metavar="M/S^2", help="stop averaging at this ± instead")
    add("-o", "--output", type=Path, metavar="FOLDER", help="where to record")
    add("--headless", action="store_true", help="no operator: progress as JSON lines")
    add("--plain", action="store_true", help="lines instead of a screen")
    add("--json", action="store_true", help="print the result as one JSON object")
    add("--no-report", action="store_true", help="write no report.html")
    add_site(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.further import check_heard, results
    from fieldcal.commands.installing import with_installed
    from fieldcal.commands.table import show
    from fieldcal.observing import rests, with_turns_between
    from fieldcal.session import RESULT, Session

    task = make_task(args)
    _check(task)
    with _link(args, task) as (driver, mover):
        found, others = _record(args, task, driver, mover)
        truth = getattr(mover, "truth", None)
    session = Session.open(task.folder)
    found = with_turns_between(found, session, rests(session))
    found = with_installed(found, session)
    written = session.write_json(RESULT, found.to_json())
    further = results(others)
    if args.json:
        more: dict[str, Any] = {"virtual": truth} if truth else {}
        if further:
            more["further"] = {name: each.to_json() for name, each in further.items()}
        sys.stdout.write(json.dumps({**found.to_json(), **more}) + "\n")
    else:
        show(found, truth)
        for name, each in further.items():
            sys.stdout.write(f"\n{name}\n")
            show(each)
        sys.stdout.write(f"recorded: {task.folder}\nwritten:  {written}\n")
    if not args.no_report:
        for folder in (task.folder, *(task.folder / name for name in further)):
            page = _report(folder)
            if page and not args.json:
                sys.stdout.write(f"report:   {page}\n")
    check_heard(others)
    return 0 if all(each.good for each in (found, *further.values())) else 1


def _report(folder: Path) -> Path | None:
    """Write the report; the calibration stands without it."""
    from fieldcal.commands.report import write

    try:
        return write(folder)
    except FieldcalError as error:
        sys.stderr.write(f"fieldcal run: no report: {error}\n")
        return None


def make_task(args: argparse.Namespace) -> Task:
    """What is to be done, from the options or a plan file.

    Raises
    ------
    InputError
        Naming what is wrong with the plan.

    """
    from fieldcal import description

    options: Mapping[str, Any]
    if args.procedure in PROCEDURES:
        module = import_module(f"fieldcal.procedures.{args.procedure}")
        tables = {"format": description.FORMAT, **site_tables(args, "device")}
        tables["position"] = [_table(p.name, p.degrees) for p in module.POSITIONS]
        options = {"procedure": args.procedure}
    else:
        tables, options = _plan_file(Path(args.procedure))
    name = str(options.get("procedure", "positions"))
    if name not in PROCEDURES:
        raise PlanError(
            f"{args.procedure}: procedure {name!r} is none of: {', '.join(PROCEDURES)}"
        )
    stamp = datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    return Task(
        procedure=name,
        tables=tables,
        about=description.parse(tables),
        seconds=args.seconds or _option(args.procedure, options, "seconds") or 30.0,
        sigma=args.sigma or _option(args.procedure, options, "sigma"),
        device=args.device or options.get("device"),
        folder=args.output or Path("sessions") / f"{stamp}-{name}",
    )


def _table(name: str, degrees: tuple[float, float] | None) -> dict[str, Any]:
    alpha, beta = degrees or (0.0, 0.0)
    return {"name": name, "alpha_deg": round(alpha, 9), "beta_deg": round(beta, 9)}


def _plan_file(path: Path) -> tuple[dict[str, Any], Mapping[str, Any]]:
    import tomllib

    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(
            f"{path}: is neither a procedure ({', '.join(PROCEDURES)}) nor a plan file"
        ) from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is no plan file: {error}") from error
    options = tables.pop("run", {})
    if not isinstance(options, dict):
        raise PlanError(f"{path}: run must be a table: write [run]")
    return tables, options


def _option(plan: str, options: Mapping[str, Any], key: str) -> float | None:
    value = options.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
        raise PlanError(f"{plan}: [run] {key} = {value!r} must be a number above 0")
    return float(value)


def _check(task: Task) -> None:
    """Refuse a plan that cannot end well, before anything moves."""
    import numpy as np

    from fieldcal.positions import forces

    if task.seconds <= 0:
        raise PlanError(f"averaging for {task.seconds:g} s: give a time above 0 s")
    positions = task.about.positions
    if len(positions) < 2 or not all(p.oriented for p in positions):
        raise PlanError(
            f"{len(positions)} positions with known angles are not enough: a plan needs"
            " two or more, each with alpha_deg and beta_deg"
        )
    f = forces(positions, 1.0)
    if np.linalg.norm(f - f[0], axis=1).max() < np.deg2rad(0.5):
        raise PlanError(
            f"all {len(positions)} positions are the same ({positions[0].name}): no"
            " scale factor can be determined; turn the device between them"
        )


@contextlib.contextmanager
def _link(args: argparse.Namespace, task: Task) -> Iterator[tuple[Driver, Mover]]:
    """Open the device, and whoever turns it."""
    from fieldcal.commands.signals import interruptible
    from fieldcal.commands.virtual import address
    from fieldcal.driver import open_driver
    from fieldcal.movers import Nobody, VirtualDevice

    with contextlib.ExitStack() as stack:
        stack.enter_context(interruptible())
        if args.virtual is not None:
            options = _virtual(args, task)
            device = stack.enter_context(VirtualDevice(options))
            url = address(options, device.port)
            yield stack.enter_context(open_driver(url)), device
        elif task.device:
            yield stack.enter_context(open_driver(task.device)), Nobody()
        else:
            raise InputError(
                'name the device: --device "serial:/dev/ttyUSB0?format=witmotion"'
                " (fieldcal ports lists them), or --virtual to try without one"
            )


def _virtual(args: argparse.Namespace, task: Task) -> list[str]:
    import shlex

    site = task.about
    options = ["--serial", VIRTUAL_FORMAT, "--speed", args.speed, "--seed", args.seed]
    options += [f"--latitude={site.latitude_deg}", f"--height={site.height_m}"]
    options += [f"--mounting={','.join(site.axes)}", f"--grade={site.grade}"]
    if "gravity" in site.raw.get("site", {}):
        options.append(f"--gravity={site.gravity}")
    return options + shlex.split(args.virtual)


def _record(
    args: argparse.Namespace, task: Task, driver: Driver, mover: Mover
) -> tuple[Calibration, Sequence[Beside]]:
    from fieldcal.beside import beside
    from fieldcal.engine import Engine
    from fieldcal.observing import with_provenance
    from fieldcal.recorder import Recorder

    plan = import_module(f"fieldcal.procedures.{task.procedure}").plan
    with (
        Recorder(task.folder, task.tables) as own,
        beside(args.further, own, task.tables) as recorder,
    ):
        with _operator(args, task, mover) as operator:
            recorder.tell = operator.tell
            give_up = GIVE_UP if args.headless or args.virtual is not None else None
            engine = Engine(driver, operator, task.about, recorder, give_up)
            if driver.notes:
                recorder.mark("device", **driver.notes)
                for text in driver.notes.get("says", ()):
                    operator.tell(text)
            try:
                found = engine.run(plan(task.about, task.seconds, task.sigma))
            except FieldcalError as error:
                recorder.mark("failed", text=str(error))
                sys.stderr.write(f"what was recorded is kept in {task.folder}\n")
                raise
            except KeyboardInterrupt:
                recorder.mark("interrupted")
                sys.stderr.write(f"what was recorded is kept in {task.folder}\n")
                raise
        recorder.mark("finished", verdict="good" if found.good else "bad")
    return with_provenance(found, task.about), recorder.others


@contextlib.contextmanager
def _operator(args: argparse.Namespace, task: Task, mover: Mover) -> Iterator[Operator]:
    if args.headless:
        from fieldcal.script import ScriptOperator

        yield ScriptOperator(mover)
        return
    from rich.console import Console

    from fieldcal.console import ConsoleOperator

    title = f"fieldcal · {task.procedure} · {task.folder}"
    console = Console(stderr=args.json)
    with ConsoleOperator(
        title, task.about.positions, mover, console, args.plain
    ) as operator:
        yield operator
