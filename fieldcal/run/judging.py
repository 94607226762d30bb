"""Judges a session while it is being recorded, for procedures that depend on it."""

from __future__ import annotations

from pathlib import Path

from fieldcal.acceptance.assessment import assess
from fieldcal.acceptance.check import MENDABLE_CHECKS
from fieldcal.acceptance.uncertainty import UNCERTAINTY
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import FieldcalError
from fieldcal.evaluation.interim_result import InterimResult
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.repaired_session import repaired_session
from fieldcal.evaluation.solution import solve_prepared
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.session.folder import Session


def judge_session(
    folder: Path, limits: GradeLimits, before: InterimResult | None = None
) -> InterimResult:
    """Judge the windows that a session has so far.

    Beginning with the explanation of `before` takes half the time. That is enough to
    choose a position, but not to end the session.

    Raises
    ------
    FieldcalError
        If no window can be used.

    """
    session, _ = repaired_session(Session.open(folder))
    windows = usable_windows(session)
    previous = None if before is None else before.explanation
    prepared = PreparedSession(session, windows, previous)
    try:
        found = assess(solve_prepared(prepared), session, windows, limits, None)
    except FieldcalError as error:
        return InterimResult(prepared, limits, None, str(error))
    failed = tuple(_failed_checks(found))
    return InterimResult(prepared, limits, found, failed_checks=failed)


def _failed_checks(found: Calibration) -> list[str]:
    """Checks that failed or could not be made yet, and that positions may change."""
    checks = found.info["decision"]["checks"]
    return [
        c["name"]
        for c in checks
        if (c["ok"] is False or (c["ok"] is None and c["name"] == "fit"))
        and (c["name"] in MENDABLE_CHECKS or c["name"].endswith(UNCERTAINTY))
    ]
