"""Judges a session while it is being recorded, for procedures that depend on it."""

from __future__ import annotations

from pathlib import Path

from fieldcal.acceptance.assessment import assess
from fieldcal.acceptance.uncertainty import UNCERTAINTY
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import GradeLimits
from fieldcal.core.errors import FieldcalError
from fieldcal.evaluation.observations import rests
from fieldcal.evaluation.so_far import SoFar
from fieldcal.evaluation.solution import Laid, solved_as
from fieldcal.session.folder import Session

MENDABLE_CHECKS = ("fit", "positions", "witnesses", "turns", "level")
"""Checks, beside those of uncertainties, that further positions may change. Checks of
site, temperature, link, insisted positions and earlier calibrations are unaffected."""


def judge_session(
    folder: Path, limits: GradeLimits, before: SoFar | None = None
) -> SoFar:
    """Judge the windows that a session has so far.

    Beginning with the explanation of `before` takes half the time. That is enough to
    choose a position, but not to end the session.

    Raises
    ------
    FieldcalError
        If no window can be used.

    """
    session = Session.open(folder)
    still = rests(session)
    laid = Laid(session, still, None if before is None else before.explanation)
    try:
        found = assess(solved_as(laid), session, still, limits, None)
    except FieldcalError as error:
        return SoFar(laid, limits, None, str(error))
    return SoFar(laid, limits, found, failed=tuple(_failed_checks(found)))


def _failed_checks(found: Calibration) -> list[str]:
    """Checks that failed or could not be made yet, and that positions may change."""
    checks = found.info["decision"]["checks"]
    return [
        c["name"]
        for c in checks
        if (c["ok"] is False or (c["ok"] is None and c["name"] == "fit"))
        and (c["name"] in MENDABLE_CHECKS or c["name"].endswith(UNCERTAINTY))
    ]
