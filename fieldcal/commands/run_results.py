"""What comes of a run: the result of each device, decided about, kept and written."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.errors import DeviceError, FieldcalError

if TYPE_CHECKING:
    from fieldcal.beside import Beside
    from fieldcal.calibration import Calibration
    from fieldcal.history import History
    from fieldcal.limits import Limits
    from fieldcal.observing import Rests
    from fieldcal.session import Session


def concluded(
    found: Calibration, session: Session, still: Rests, bounds: Limits, history: History
) -> Calibration:
    """Add what the turns say, decide, write it down and keep it.

    Parameters
    ----------
    found : what the windows say
    session, still : its session, and the windows
    bounds : limits of the device's grade
    history : where it is kept, if the device has a serial number

    """
    from fieldcal.assessing import assess, remember
    from fieldcal.commands.installing import with_installed
    from fieldcal.observing import with_provenance, with_turns_between
    from fieldcal.session import RESULT

    found = with_turns_between(found, session, still)
    found = with_installed(with_provenance(found, session.about), session)
    found = assess(found, session, still, bounds, history)
    session.write_json(RESULT, found.to_json())
    if said := remember(history, session, found):
        sys.stderr.write(f"fieldcal run: {said}\n")
    return found


def first_result(
    found: Calibration, folder: Path, bounds: Limits, history: History
) -> Calibration:
    """Result of the device that was led through the procedure."""
    from fieldcal.observing import rests
    from fieldcal.session import Session

    session = Session.open(folder)
    return concluded(found, session, rests(session), bounds, history)


def further_results(
    others: Sequence[Beside], bounds: Limits, history: History
) -> dict[str, Calibration]:
    """Results of the further devices that were heard to the end, by folder."""
    found = {}
    for other in others:
        if other.failed is None:
            try:
                found[other.folder.name] = _solved(other.folder, bounds, history)
            except FieldcalError as fault:
                other.failed = fault
    return found


def _solved(folder: Path, bounds: Limits, history: History) -> Calibration:
    from fieldcal.observing import observations, rests
    from fieldcal.session import Session
    from fieldcal.solve import solve

    session = Session.open(folder)
    still = rests(session)
    seen = observations(session.about, still.averages, still.rows)
    found = solve(seen, level_sigma_deg=session.about.level_deg)
    found = replace(found, warnings=(*still.warnings, *found.warnings))
    return concluded(found, session, still, bounds, history)


def check_heard(others: Sequence[Beside]) -> None:
    """Say which of the further devices failed.

    Raises
    ------
    DeviceError
        Naming the first of them.

    """
    for other in others:
        if other.failed is not None:
            raise DeviceError(
                f"{other.folder.name}: {other.failed}; the other devices have their"
                " results"
            )
