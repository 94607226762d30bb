"""Devices beside the first: the option that names them, and a result for each."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.errors import DeviceError, FieldcalError

if TYPE_CHECKING:
    from fieldcal.beside import Beside
    from fieldcal.calibration import Calibration
    from fieldcal.history import History
    from fieldcal.limits import Limits


class Devices(argparse.Action):
    """``--device`` once or several times: the first, and the `further` ones."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Take one more address."""
        if getattr(namespace, self.dest) is None:
            setattr(namespace, self.dest, values)
        else:
            namespace.further = [*namespace.further, values]


def solved(folder: Path, bounds: Limits, history: History) -> Calibration:
    """Solve the session of one of several devices, decide, and write its result."""
    from dataclasses import replace

    from fieldcal.assessing import assess
    from fieldcal.commands.installing import with_installed
    from fieldcal.observing import (
        observations,
        rests,
        with_provenance,
        with_turns_between,
    )
    from fieldcal.session import RESULT, Session
    from fieldcal.solve import solve

    session = Session.open(folder)
    still = rests(session)
    seen = observations(session.about, still.averages, still.rows)
    found = solve(seen, level_sigma_deg=session.about.level_deg)
    found = with_turns_between(found, session, still)
    found = replace(found, warnings=(*still.warnings, *found.warnings))
    found = with_installed(with_provenance(found, session.about), session)
    found, _ = assess(found, session, still, bounds, history)
    session.write_json(RESULT, found.to_json())
    return found


def results(
    others: Sequence[Beside], bounds: Limits, history: History
) -> dict[str, Calibration]:
    """Results of the further devices that were heard to the end, by folder."""
    found = {}
    for other in others:
        if other.failed is None:
            try:
                found[other.folder.name] = solved(other.folder, bounds, history)
            except FieldcalError as fault:
                other.failed = fault
    return found


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
