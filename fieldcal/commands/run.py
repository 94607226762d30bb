"""`fieldcal run`: take a device through a procedure, at the console or headless."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.further import Devices
from fieldcal.commands.site import add_site, given_tables, over, site_tables
from fieldcal.errors import FieldcalError, InputError

if TYPE_CHECKING:
    from fieldcal.beside import Beside
    from fieldcal.calibration import Calibration
    from fieldcal.history import History
    from fieldcal.limits import Limits
    from fieldcal.movers import Mover
    from fieldcal.plan_file import Task
    from fieldcal.view import Operator

EXAMPLE = """\
  fieldcal run five_position --device "serial:/dev/ttyUSB0?format=witmotion"
  fieldcal run five_position --virtual --speed 20
  fieldcal run plan.toml --headless --json --junit run.xml > result.json
  fieldcal run --resume sessions/2026-03-01T09-30-00-five_position
"""

GIVE_UP, GIVE_UP_UNTURNED = 90.0, 600.0
"""Device time after which a script gives a position up, s: with and without a mover."""

PATIENCE, PATIENCE_HEADLESS = 120.0, 20.0
"""How long a device that is gone is waited for, s."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "procedure",
        nargs=argparse.OPTIONAL,
        metavar="PROCEDURE",
        help="two_position, five_position, positions, or a plan file (a session.toml"
        " with positions, and a table [run])",
    )
    add("--resume", type=Path, metavar="SESSION", help="go on with a run broken off")
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
    add(
        "--level",
        type=float,
        metavar="DEG",
        help="how level the base is, 1σ about each axis; two positions cannot see it",
    )
    add("--verify", action="store_true", help="one more position, which is not fitted")
    add("--limits", type=Path, metavar="FILE", help="limits for GO and NO-GO")
    add("--history", type=Path, metavar="FILE", help="instead of the usual history")
    add(
        "--patience",
        type=float,
        metavar="S",
        help="how long to wait for a device that is gone"
        f" (default: {PATIENCE:g}, headless {PATIENCE_HEADLESS:g})",
    )
    add("-o", "--output", type=Path, metavar="FOLDER", help="where to record")
    add("--headless", action="store_true", help="no operator: progress as JSON lines")
    add("--plain", action="store_true", help="lines instead of a screen")
    add("--json", action="store_true", help="print the result as one JSON object")
    add("--no-report", action="store_true", help="write no report.html")
    add("--junit", type=Path, metavar="FILE", help="write what happened as JUnit XML")
    add_site(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal import junit, limits
    from fieldcal.commands.further import check_heard, results
    from fieldcal.history import History, default_path
    from fieldcal.session import read_marks

    task, folder = make_task(args)
    file = args.limits or task.run.get("limits")
    bounds = limits.read(task.about.grade, Path(file) if file else None)
    marks = folder / "marks.jsonl"
    try:
        found, truth, others = _record(args, task, folder, bounds)
        history = History(args.history or default_path())
        found = _result(found, folder, bounds, history)
    except (FieldcalError, KeyboardInterrupt) as error:
        begun = os.path.exists(marks)  # where nobody may look, nothing was begun
        if begun:
            sys.stderr.write(_kept(folder))
        if args.junit and begun:
            said = str(error) or "interrupted"
            known = list(read_marks(marks))
            junit.write(args.junit, task.procedure, task.positions, known, None, said)
        raise
    result = found.to_json()
    if args.junit:
        known = list(read_marks(marks))
        junit.write(args.junit, task.procedure, task.positions, known, result)
    further = results(others, bounds, history)
    _show(args, found, folder, truth, further)
    if not args.no_report:
        for each in (folder, *(folder / name for name in further)):
            page = _report(each, history.path)
            if page and not args.json:
                sys.stdout.write(f"report:   {page}\n")
    if not args.json:
        _show_decisions(found, further)
    check_heard(others)
    return 0 if all(map(_go, (found, *further.values()))) else 1


def _go(found: Calibration) -> bool:
    return found.good and bool(found.info["decision"]["go"])


def _show_decisions(found: Calibration, further: Mapping[str, Calibration]) -> None:
    """That of the first device last, but for a line on each that is NO-GO."""
    from fieldcal.commands.decision_view import show_decision

    for name, each in further.items():
        sys.stdout.write(f"\n{name}\n")
        show_decision(each)
    if further:
        sys.stdout.write("\nthe first device\n")
    show_decision(found)
    for name, each in further.items():
        sys.stdout.write(f"{name}: {'GO' if _go(each) else 'NO-GO, see above'}\n")


def _report(folder: Path, history: Path) -> Path | None:
    """Write the report; the calibration stands without it."""
    from fieldcal.commands.report import write

    try:
        return write(folder, history=history)
    except FieldcalError as error:
        sys.stderr.write(f"fieldcal run: no report: {error}\n")
        return None


def make_task(args: argparse.Namespace) -> tuple[Task, Path]:
    """What is to be done, and where, from the options, a plan file or a session.

    Raises
    ------
    InputError
        Naming what is wrong with the plan.

    """
    from fieldcal import description, plan_file

    if args.resume:
        if args.procedure or args.output:
            raise InputError("--resume goes on with what it finds: give it alone")
        if given_tables(args):
            raise InputError(
                "--resume goes on with the device and place its session.toml names:"
                " leave those options out"
            )
        from fieldcal.running import resumed

        session, tables = resumed(args.resume)
        tables["run"] = {**tables["run"], **_given(args)}
        tables = over(tables, _level(args))
        return plan_file.task(tables, f"{args.resume}/session.toml"), session.folder
    if not args.procedure:
        raise InputError(
            f"name a procedure ({', '.join(plan_file.PROCEDURES)}) or a plan file"
        )
    name = args.procedure
    if name in plan_file.PROCEDURES:
        module = import_module(f"fieldcal.procedures.{name}")
        tables = {"format": description.FORMAT, **site_tables(args, "device")}
        tables["position"] = [_table(p.name, p.degrees) for p in module.POSITIONS]
        tables["run"] = {"procedure": name, **_given(args)}
        name = "the options"
    else:
        tables = plan_file.read(Path(name))
        if not isinstance(tables.get("run", {}), dict):
            raise InputError(f"{name}: run must be a table: write [run]")
        tables = over(tables, given_tables(args))
        tables["run"] = {**tables.get("run", {}), **_given(args)}
    tables = over(tables, _level(args))
    task = plan_file.task(tables, name)
    stamp = datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    return task, args.output or Path("sessions") / f"{stamp}-{task.procedure}"


def _level(args: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """How level the base is, if an option says it."""
    return {} if args.level is None else {"site": {"level_deg": args.level}}


def _given(args: argparse.Namespace) -> dict[str, Any]:
    """The table [run] as far as options say it."""
    given: dict[str, Any] = {
        "device": args.device,
        "further": args.further or None,
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


def _table(name: str, degrees: tuple[float, float] | None) -> dict[str, Any]:
    alpha, beta = degrees or (0.0, 0.0)
    return {"name": name, "alpha_deg": round(alpha, 9), "beta_deg": round(beta, 9)}


def _record(
    args: argparse.Namespace, task: Task, folder: Path, bounds: Limits
) -> tuple[Calibration, dict[str, Any] | None, Sequence[Beside]]:
    """Hold the positions, record and solve; and what a virtual device conceals."""
    from fieldcal.beside import beside
    from fieldcal.commands.run_device import device
    from fieldcal.level import level_unknown
    from fieldcal.recorder import Recorder
    from fieldcal.running import Running, taken_before
    from fieldcal.session import Session

    with device(task) as (opened, mover):
        driver = opened()
        with contextlib.ExitStack() as stack:
            stack.callback(driver.close)
            taken = taken_before(Session.open(folder), task) if args.resume else {}
            tables = None if args.resume else task.tables
            own = stack.enter_context(Recorder(folder, tables))
            further = task.run.get("further", [])
            recorder = stack.enter_context(beside(further, own, task.tables))
            operator = stack.enter_context(_operator(args, task, mover, folder))
            recorder.tell = operator.tell
            if unseen := level_unknown(task.about):
                operator.tell(unseen)
            if args.resume:
                recorder.mark("resumed", taken=sorted(taken))
            patience = PATIENCE_HEADLESS if args.headless else PATIENCE
            running = Running(
                task,
                operator,
                recorder,
                opened,
                bounds,
                patience if args.patience is None else args.patience,
                _give_up(args, task),
                taken,
            )
            try:
                found = running.run(driver)
            except (FieldcalError, KeyboardInterrupt) as error:
                recorder.mark("failed", text=str(error) or "interrupted")
                raise
            recorder.mark("finished", verdict="good" if found.good else "bad")
        truth = getattr(mover, "truth", None)
        return found, dict(truth) if truth else None, recorder.others


def _kept(folder: Path) -> str:
    return (
        f"what was recorded is kept in {folder}; to go on:"
        f" fieldcal run --resume {shlex.quote(str(folder))}\n"
    )


def _give_up(args: argparse.Namespace, task: Task) -> float | None:
    """How long a position is waited for; for a person, for ever."""
    given = task.run.get("give_up_s")
    unturned = task.mover["kind"] == "nothing"
    if given is not None:
        return float(given)
    if unturned:
        return GIVE_UP_UNTURNED if args.headless else None
    return GIVE_UP


def _result(
    found: Calibration, folder: Path, bounds: Limits, history: History
) -> Calibration:
    """Add what the turns say, decide, write it down and keep it."""
    from fieldcal.assessing import assess, remember
    from fieldcal.commands.installing import with_installed
    from fieldcal.observing import rests, with_provenance, with_turns_between
    from fieldcal.session import RESULT, Session

    session = Session.open(folder)
    still = rests(session)
    found = with_turns_between(found, session, still)
    found = with_installed(with_provenance(found, session.about), session)
    found, _ = assess(found, session, still, bounds, history)
    session.write_json(RESULT, found.to_json())
    if said := remember(history, session, found):
        sys.stderr.write(f"fieldcal run: {said}\n")
    return found


def _show(
    args: argparse.Namespace,
    found: Calibration,
    folder: Path,
    truth: dict[str, Any] | None,
    further: Mapping[str, Calibration],
) -> None:
    from fieldcal.commands.table import show
    from fieldcal.session import RESULT

    if args.json:
        more: dict[str, Any] = {"virtual": truth} if truth else {}
        if further:
            more["further"] = {name: each.to_json() for name, each in further.items()}
        sys.stdout.write(json.dumps({**found.to_json(), **more}) + "\n")
        return
    show(found, truth)
    for name, each in further.items():
        sys.stdout.write(f"\n{name}\n")
        show(each)
    sys.stdout.write(f"recorded: {folder}\nwritten:  {folder / RESULT}\n")


@contextlib.contextmanager
def _operator(
    args: argparse.Namespace, task: Task, mover: Mover, folder: Path
) -> Iterator[Operator]:
    if args.headless:
        from fieldcal.script import ScriptOperator

        yield ScriptOperator(mover)
        return
    from rich.console import Console

    from fieldcal.console import ConsoleOperator
    from fieldcal.keyboard import Keyboard

    with ConsoleOperator(
        f"fieldcal · {task.procedure} · {folder}",
        task.positions,
        mover,
        Console(stderr=args.json),
        args.plain,
        Keyboard(),
        len(task.about.positions) if task.verification else None,
    ) as operator:
        yield operator
