"""Judges a session while it is being recorded, for procedures that go by it."""

from __future__ import annotations

from pathlib import Path

from fieldcal.acceptance.assessment import assess
from fieldcal.acceptance.uncertainty import UNCERTAINTY
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import FieldcalError
from fieldcal.evaluation.interim_result import InterimResult
from fieldcal.evaluation.observations import usable_windows
from fieldcal.evaluation.solution import PreparedSession, solve_prepared
from fieldcal.session.folder import Session

MENDED = ("fit", "positions", "witnesses", "turns", "level")
"""Checks beside those of uncertainties that further positions may mend. The place, the
temperature, the link, what the operator insisted on and how the device was at earlier
calibrations stay as they are."""


def judged(
    folder: Path, limits: GradeLimits, before: InterimResult | None = None
) -> InterimResult:
    """What the windows that a session has are good for.

    Beginning with what was found of some of them `before` takes half the time: enough
    for the choice of a position, and for no end.

    Raises
    ------
    FieldcalError
        If no window can be used.

    """
    session = Session.open(folder)
    still = usable_windows(session)
    prepared = PreparedSession(
        session, still, None if before is None else before.explanation
    )
    try:
        found = assess(solve_prepared(prepared), session, still, limits, None)
    except FieldcalError as error:
        return InterimResult(prepared, limits, None, str(error))
    return InterimResult(prepared, limits, found, failed_checks=tuple(_failed(found)))


def _failed(found: Calibration) -> list[str]:
    """Checks that failed and may be mended, or could not be made as yet."""
    checks = found.info["decision"]["checks"]
    return [
        c["name"]
        for c in checks
        if (c["ok"] is False or (c["ok"] is None and c["name"] == "fit"))
        and (c["name"] in MENDED or c["name"].endswith(UNCERTAINTY))
    ]
