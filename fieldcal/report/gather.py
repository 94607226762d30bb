"""Input of a report: the session's files, read once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.documents import load_json
from fieldcal.core.errors import FieldcalError, InputError, SessionError
from fieldcal.core.samples import Block
from fieldcal.evaluation.usable_windows import UsableWindows, usable_windows
from fieldcal.session.folder import RESULT, Session
from fieldcal.session.result_source import outdated_text

DIAGNOSIS = "diagnosis.json"
AGAINST = "against.json"

MAX_SHOWN_TIME = 1e6
"""Device times above this are shown less their start, s: they have too many digits."""


@dataclass(frozen=True, slots=True)
class EarlierCalibration:
    """A calibration of the same device from another day.

    Attributes
    ----------
    label : when or where, as the reader is to see it
    calibration : what was found then

    """

    label: str
    calibration: Calibration


@dataclass(frozen=True, slots=True)
class ReportMaterial:
    """A session with its results: the input of all sections.

    Attributes
    ----------
    session : the folder
    block : its samples, SI
    windows : averages of its windows; None where it has none that can be used
    windows_error : why there are none, empty otherwise
    calibration : of result.json, None where it has not been solved
    diagnosis : of diagnosis.json, None where there is none
    marks : what happened, in order
    earlier : calibrations of the same device, oldest first
    against : of against.json, None where there is none
    outdated : what is wrong with a calibration of the session as it was before

    """

    session: Session
    block: Block
    windows: UsableWindows | None
    windows_error: str
    calibration: Calibration | None
    diagnosis: Mapping[str, Any] | None
    marks: tuple[Mapping[str, Any], ...]
    earlier: tuple[EarlierCalibration, ...] = ()
    against: Mapping[str, Any] | None = None
    outdated: str = ""

    @property
    def epoch(self) -> float:
        """Offset that charts subtract from device times, s; 0 for small times."""
        start = float(self.block.t[0])
        return float(np.floor(start)) if abs(start) > MAX_SHOWN_TIME else 0.0

    @property
    def clock(self) -> str:
        """Label of the time axis of a chart."""
        return f"device time − {self.epoch:.0f}" if self.epoch else "device time"

    def position_name(self, row: int) -> str:
        """Number of a position, with its name if it has one."""
        name = self.session.positions[row].name
        number = row + 1
        return f"{number}" if name == f"position {number}" else f"{number} · {name}"


def gather(
    folder: Path | str, earlier: Iterable[EarlierCalibration] = ()
) -> ReportMaterial:
    """Read a session for its report.

    Raises
    ------
    SessionError
        If the folder is no session or one of its files cannot be read.

    """
    session = Session.open(folder)
    block = session.block
    still, trouble = None, ""
    try:
        still = usable_windows(session)
    except FieldcalError as error:
        trouble = str(error)
    result = _read(session.folder / RESULT)
    return ReportMaterial(
        session=session,
        block=block,
        windows=still,
        windows_error=trouble,
        calibration=None if result is None else _calibration(session, result),
        diagnosis=_read(session.folder / DIAGNOSIS),
        marks=tuple(session.marks()),
        earlier=tuple(earlier),
        against=_read(session.folder / AGAINST),
        outdated="" if result is None else outdated_text(session.folder, result),
    )


def read_earlier_result(path: Path) -> EarlierCalibration:
    """A calibration from a session folder or a result.json.

    Raises
    ------
    SessionError
        If there is none.

    """
    file = path / RESULT if path.is_dir() else path
    document = _read(file)
    if document is None:
        raise SessionError(f"{file}: no result there; run fieldcal solve first")
    name = file.parent.name if file.name == RESULT else file.stem
    try:
        return EarlierCalibration(name, Calibration.from_json(document))
    except InputError as error:
        raise SessionError(f"{file}: {error}") from error


def _calibration(session: Session, document: Mapping[str, Any]) -> Calibration:
    try:
        return Calibration.from_json(document)
    except InputError as error:
        raise SessionError(
            f"{session.folder / RESULT}: {error}; run fieldcal solve again"
        ) from error


def _read(path: Path) -> Mapping[str, Any] | None:
    try:
        content = load_json(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise SessionError(f"{path}: cannot be read: {error}; make it again") from error
    if not isinstance(content, dict):
        raise SessionError(f"{path}: holds no JSON object; make it again")
    return content
