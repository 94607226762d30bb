"""Going on with a session: what it has already, and what is left to take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from fieldcal import procedures
from fieldcal.core.documents import load_json
from fieldcal.core.errors import (
    FieldcalError,
    SessionError,
)
from fieldcal.core.positions import Position
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.run.plan_file import PlanTask
from fieldcal.session.folder import RESULT, Session
from fieldcal.session.marks import POSITION_ADDED, taken_windows
from fieldcal.windows import Average, average

CLOCK_TOLERANCE_S = 1.0
"""Difference between the time of a file and that of a mark of the same instant, s."""


def recorded_averages(session: Session, task: PlanTask) -> dict[int, Average]:
    """Averages of the positions with a complete window in a session, by number."""
    windows, taken = taken_windows(session.marks()), dict[int, Average]()
    with suppress(SessionError):
        still = usable_windows(session)
        taken = dict(zip(still.position_numbers, still.averages, strict=True))
    last = len(task.about.positions)
    window = windows.get(last)
    if window is not None and task.verification is not None:
        with suppress(FieldcalError):
            taken[last] = average(session.block.between(*window))
    return {number: held for number, held in taken.items() if number in windows}


def open_for_resume(folder: Path) -> tuple[Session, dict[str, Any], tuple[int, ...]]:
    """A session to go on with, its tables, and positions to take once more.

    What is finished and NO-GO is gone on with by its remedy: positions besides, or one
    that was taken already; where it has none, by the positions that were left out.

    Raises
    ------
    SessionError
        If it is none, has nothing left to take, was not recorded by a run, or is that
        of a further device.

    """
    session = Session.open(folder)
    tables = dict(session.about.raw)
    if "run" not in tables:
        raise SessionError(
            f"{folder}: was not recorded by fieldcal run: begin a new one, or solve it"
            " as it stands by fieldcal solve"
        )
    marks, again = list(session.marks()), tuple[int, ...]()
    run = dict(tables["run"])
    if session.about.device.get("address") in run.get("further", ()):
        raise SessionError(
            f"{folder}: is the session of a further device of a run: go on with that"
            f" one, --resume {folder.absolute().parent}"
        )
    if is_decided(session):
        remedy = _remedy(folder, session)
        again = tuple(int(i) for i in remedy["again"])
        last = len(session.positions)
        if remedy["positions"] and last in taken_windows(marks):
            again += (last,)  # what verified goes behind the positions besides, anew
        tables["position"] = [
            *tables.get("position", ()),
            *_remedy_positions(remedy, session),
        ]
        run["seconds"] = float(remedy.get("seconds", run.get("seconds", 30.0)))
    fixed = (
        procedures.max_positions(session.about, str(run.get("procedure", ""))) is None
    )
    if fixed and len(tables.get("position", ())) > _planned_count(marks, session):
        run["procedure"] = "positions"  # whatever set it was, it has more now
    return session, {**tables, "run": run}, again


def _remedy_positions(remedy: Mapping[str, Any], session: Session) -> list[Any]:
    """Positions of a remedy without those left out before, which are asked anyway."""
    known = session.about.positions
    left_out = {known[i].degrees for i in positions_left_out(session)}
    return [
        place for place in remedy["positions"]
        if Position.deg(place["alpha_deg"], place["beta_deg"]).degrees not in left_out
    ]  # fmt: skip


def positions_left_out(session: Session) -> tuple[int, ...]:
    """Numbers of the positions without a valid window."""
    taken = taken_windows(session.marks())
    return tuple(i for i in range(len(session.about.positions)) if i not in taken)


def _planned_count(marks: Sequence[Mapping[str, Any]], session: Session) -> int:
    """Number of positions that a session was begun with."""
    added = sum(bool(mark.get("event") == POSITION_ADDED) for mark in marks)
    return len(session.about.positions) - added


def is_decided(session: Session) -> bool:
    """Whether the last run of a session came to its result."""
    marks = list(session.marks())
    return is_finished(marks) and _has_result(session.folder, marks)


def is_finished(marks: Sequence[Mapping[str, Any]]) -> bool:
    """Whether no position was asked for since a run had its result."""
    told = [m.get("event") for m in marks]
    ends = [i for i, event in enumerate(told) if event == "finished"]
    return bool(ends) and not {POSITION_ADDED, "repeated", "asked"} & set(
        told[ends[-1] :]
    )


def _has_result(folder: Path, marks: Sequence[Mapping[str, Any]]) -> bool:
    """Whether there is a result of the last run, and not of one that it went on with.

    One that was ended while it was being solved has left the result before it, whose
    remedy was taken already.
    """
    ends = [m for m in marks if m.get("event") == "finished"]
    try:
        written = (folder / RESULT).stat().st_mtime
    except OSError:
        return False
    return written > float(ends[-1].get("host_s") or 0.0) - CLOCK_TOLERANCE_S


def _remedy(folder: Path, session: Session) -> Mapping[str, Any]:
    """The remedy that would make a finished session GO.

    Raises
    ------
    SessionError
        If it is GO, or no position would.

    """
    try:
        result = load_json((folder / RESULT).read_text(encoding="utf-8"))
        decision = result.get("decision", {})
    except (OSError, ValueError, AttributeError):
        decision = {}
    remedy = decision.get("remedy")
    if isinstance(remedy, Mapping):
        return remedy
    if decision.get("go") is False and (left_out := positions_left_out(session)):
        return {"again": left_out, "positions": ()}
    if decision.get("go") is False:
        raise SessionError(
            f"{folder}: is finished and NO-GO, and no position taken besides would"
            " change that: see fieldcal solve for the reasons, and begin a new run"
        )
    raise SessionError(
        f"{folder}: is finished, nothing is left to take: see fieldcal solve"
    )
