"""The recording of a run: device, mover and operator, from first to last position."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.run_operator import run_operator
from fieldcal.commands.run_task import make_room
from fieldcal.commands.run_timeouts import (
    can_ask_operator,
    give_up_seconds,
    reconnect_seconds,
)
from fieldcal.core.errors import FieldcalError

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.calibration.limits import GradeLimits
    from fieldcal.drivers.driver import Driver
    from fieldcal.run.companions import Companion, LeadRecorder
    from fieldcal.run.page.server import PageServer
    from fieldcal.run.plan_file import PlanTask
    from fieldcal.run.session_run import SessionRun


def record_and_solve(
    args: argparse.Namespace,
    task: PlanTask,
    folder: Path,
    bounds: GradeLimits,
    page: PageServer | None,
) -> tuple[Calibration, dict[str, Any] | None, Sequence[Companion]]:
    """Record the positions and solve.

    Returns the calibration, the truth of a virtual device, and the further devices.
    """
    from fieldcal.commands.run_device import device_and_mover
    from fieldcal.run.companions import record_companions, refuse_recorded_companions
    from fieldcal.run.resuming import recorded_averages
    from fieldcal.run.retrying_mover import RetryingMover
    from fieldcal.run.session_run import SessionRun
    from fieldcal.session.folder import Session
    from fieldcal.session.lock import refuse_in_use
    from fieldcal.session.recorder import Recorder

    refuse_in_use(folder)  # before its device, which that run has open
    with device_and_mover(task) as (opened, mover), contextlib.ExitStack() as stack:
        driver = opened()
        stack.callback(driver.close)
        known = Session.open(folder) if args.resume else None
        taken = recorded_averages(known, task) if known else {}
        if not args.resume:
            make_room(folder, args.headless)
            refuse_recorded_companions(folder, len(task.further))
        own = stack.enter_context(Recorder(folder, None if known else task.tables))
        args.records = True
        recorder = stack.enter_context(
            record_companions(task.further, own, task.tables)
        )
        turns = RetryingMover(mover, reconnect_seconds(args))
        operator = stack.enter_context(run_operator(args, task, turns, folder, page))
        turns.tell = recorder.tell = operator.tell
        for sentence in _missing_statements(task):
            operator.tell(sentence)
        if known:
            _mark_remedy_positions(
                recorder, task, len(known.positions), args.again, taken
            )
            recorder.mark("resumed", taken=sorted(taken))
        running = SessionRun(
            task,
            operator,
            recorder,
            opened,
            bounds,
            reconnect_seconds(args),
            give_up_seconds(args, task),
            taken,
            can_ask_operator(args),
        )
        found = _run_and_mark(running, driver, recorder)
        truth = getattr(mover, "truth", None)
        return found, dict(truth) if truth else None, recorder.others


def _run_and_mark(
    running: SessionRun, driver: Driver, recorder: LeadRecorder
) -> Calibration:
    """Carry the run out, and mark how it ended."""
    try:
        found = running.run(driver)
    except (FieldcalError, KeyboardInterrupt) as error:
        recorder.mark("failed", text=str(error) or "interrupted")
        raise
    recorder.mark("finished", verdict="good" if found.good else "bad")
    return found


def _missing_statements(task: PlanTask) -> list[str]:
    """Sentences about missing level, site and angles, without which it is NO-GO."""
    from fieldcal import procedures
    from fieldcal.acceptance.angles import unstated_angles_warning
    from fieldcal.acceptance.level import level_warning_before_run
    from fieldcal.acceptance.site import (
        gravity_missing_warning,
        latitude_missing_warning,
    )

    unsaid = [unstated_angles_warning(task.about)]
    if procedures.max_positions(task.about, task.procedure) is None:
        unsaid.append(level_warning_before_run(task.about))
    unsaid.append(latitude_missing_warning(task.about))
    unsaid.append(gravity_missing_warning(task.about))  # the most important one last
    return [sentence for sentence in unsaid if sentence]


def _mark_remedy_positions(
    recorder: Any,
    task: PlanTask,
    known: int,
    again: Sequence[int],
    taken: dict[int, Any],
) -> None:
    """Mark the positions that a remedy adds and those that it repeats."""
    from fieldcal.session.marks import POSITION_ADDED
    from fieldcal.session.position_tables import position_table

    for number in again:
        recorder.mark("repeated", position=number)
        taken.pop(number, None)
    for number, position in enumerate(task.about.positions[known:], known):
        where = {**position_table(position), "seconds": task.seconds}
        recorder.mark(POSITION_ADDED, position=number, **where)
