"""What a run prints at its end, of the first device and of its companions."""

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
    """Print the table of each device, and where the session is."""
    from fieldcal.commands.table import show
    from fieldcal.session.folder import RESULT

    show(found, truth)
    for name, each in further.items():
        sys.stdout.write(f"\n{name}\n")
        show(each)
    sys.stdout.write(f"recorded: {folder}\nwritten:  {folder / RESULT}\n")


def show_decisions(
    found: Calibration, further: Mapping[str, Calibration], folder: Path
) -> None:
    """That of the first device last, but for a line on each that is NO-GO."""
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
    """Whether a device may be launched with."""
    return found.good and bool(found.info["decision"]["go"])


def write_report(folder: Path, history: StoreLocation) -> Path | None:
    """Write the report; the calibration stands without it."""
    from fieldcal.commands.report import write

    try:
        return write(folder, history=history)
    except FieldcalError as error:
        sys.stderr.write(f"fieldcal run: no report: {error}\n")
        return None
