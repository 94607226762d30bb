"""Output of a run at its end, for the first device and the further ones."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import FieldcalError

if TYPE_CHECKING:
    from fieldcal.calibration import Calibration
    from fieldcal.history.location import StoreLocation


def show_json(
    found: Calibration,
    truth: Mapping[str, Any] | None,
    further: Mapping[str, Calibration],
) -> None:
    """Print all results as one JSON object."""
    more: dict[str, Any] = {"virtual": truth} if truth else {}
    if further:
        more["further"] = {name: each.to_json() for name, each in further.items()}
    sys.stdout.write(json.dumps({**found.to_json(), **more}) + "\n")


def show_results(
    found: Calibration,
    folder: Path,
    truth: Mapping[str, Any] | None,
    further: Mapping[str, Calibration],
) -> None:
    """Print the table of each device, and the path of the session."""
    from fieldcal.commands.table import show_calibration
    from fieldcal.session.folder import RESULT

    show_calibration(found, truth)
    for name, each in further.items():
        sys.stdout.write(f"\n{name}\n")
        show_calibration(each)
    sys.stdout.write(f"recorded: {folder}\nwritten:  {folder / RESULT}\n")


def show_decisions(
    found: Calibration, further: Mapping[str, Calibration], folder: Path
) -> None:
    """Print the decision of each device, that of the first device last.

    A line for each further device follows.
    """
    from fieldcal.commands.decision_view import show_decision

    for name, each in further.items():
        sys.stdout.write(f"\n{name}\n")
        show_decision(each)
    if further:
        sys.stdout.write("\nthe first device\n")
    show_decision(found, folder)
    for name, each in further.items():
        sys.stdout.write(f"{name}: {'GO' if is_go(each) else 'NO-GO, see above'}\n")


def is_go(found: Calibration) -> bool:
    """Whether the calibration is good and the decision is GO."""
    return found.good and bool(found.info["decision"]["go"])


def try_write_report(folder: Path, history: StoreLocation) -> Path | None:
    """Write the report; a failure is only reported. None if there is no report."""
    from fieldcal.commands.report import write_report

    try:
        return write_report(folder, history=history)
    except FieldcalError as error:
        sys.stderr.write(f"fieldcal run: no report: {error}\n")
        return None
