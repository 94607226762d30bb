"""A run without an operator, for tests: a driver, a mover, a folder."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fieldcal.calibration import Calibration, limits
from fieldcal.drivers.driver import Driver
from fieldcal.evaluation.repaired_session import repaired_session, with_repairs
from fieldcal.evaluation.solution import solve_session
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.run import plan_file
from fieldcal.run.movers import VirtualMover
from fieldcal.run.operator.script import ScriptOperator
from fieldcal.run.session_run import SessionRun
from fieldcal.session import description_file
from fieldcal.session.folder import Session
from fieldcal.session.recorder import Recorder

GIVE_UP = 90.0
"""Device time after which a position is given up, s."""


def recalibrate(
    driver: Driver,
    device: VirtualMover,
    folder: Path,
    procedure: str,
    seconds: float,
    latitude_deg: float,
    tables: Mapping[str, Any],
) -> Calibration:
    """Take a virtual device through a procedure and solve.

    Raises
    ------
    FieldcalError
        As a run without an operator ends; what was recorded is in `folder`.

    """
    truth = device.truth
    known = {
        "device": {"name": "virtual device", "grade": truth["grade"]},
        "site": {"latitude_deg": latitude_deg, "gravity": truth["gravity"]},
        "frame": {"mounting": truth["mounting"]},
    }
    whole = {
        "format": description_file.FORMAT_VERSION,
        **known,
        "position": plan_file.default_positions(procedure),
        "run": {"procedure": procedure, "seconds": seconds},
        **tables,
    }
    task = plan_file.task_from_tables(whole, procedure)

    def once() -> Driver:
        return driver

    with Recorder(folder, whole) as recorder:
        operator = ScriptOperator(device, io.StringIO())
        bounds = limits.read(task.about.grade)
        running = SessionRun(task, operator, recorder, once, bounds, 0.0, GIVE_UP)
        found = running.run(driver)
    session, repaired = repaired_session(Session.open(folder))
    solved = solve_session(session, usable_windows(session), method=found.method)
    return with_repairs(solved, repaired)
