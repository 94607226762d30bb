"""One session, from its folder to its row in the store; nothing is written here."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fieldcal.acceptance.assessment import (
    assess,
    limits_path,
    planned_limits,
    start_time,
    with_faults,
)
from fieldcal.calibration import limits
from fieldcal.core.documents import load_toml
from fieldcal.core.errors import FieldcalError
from fieldcal.core.file_names import storable_text
from fieldcal.diagnosis.verdict import make_diagnosis
from fieldcal.evaluation.prepared_session import PreparedSession
from fieldcal.evaluation.repaired_session import repaired_session, with_repairs
from fieldcal.evaluation.solution import solve_prepared
from fieldcal.evaluation.usable_windows import usable_windows
from fieldcal.fleet.reduced import reduce_session
from fieldcal.fleet.tree import fingerprint
from fieldcal.history.sessions import StoredSession, session_of_calibration
from fieldcal.session.description_file import with_bare_names
from fieldcal.session.folder import DESCRIPTION, Session
from fieldcal.session.recorded_part import recorded_part

OUT_OF_MEMORY = "it needs more memory than there is"


@dataclass(frozen=True, slots=True)
class SessionTask:
    """Solve a session and, if asked, diagnose it; called with the folder.

    Attributes
    ----------
    diagnose : whether a diagnosis is made as well
    limits : file of limits by which every session is judged; None: its grade's

    """

    diagnose: bool = False
    limits: str | None = None

    @property
    def options(self) -> str:
        """Text that differs if a session has to be processed again."""
        bounds = Path(self.limits).read_text("utf-8") if self.limits else ""
        return f"diagnose={self.diagnose}\n{bounds}"

    def fingerprint(self, folder: Path) -> str:
        """Hash of a session's inputs, the options, and the limits it is judged by.

        Raises
        ------
        OSError
            If a file of the session cannot be read.

        """
        own = "" if self.limits else _limits_in_plan(folder)
        return fingerprint(folder, f"{self.options}\n{own}")

    def __call__(self, folder: str) -> StoredSession:
        """Process a session; an error is stated in the row that is returned."""
        mark, name = None, storable_text(folder)
        try:
            mark = self.fingerprint(Path(folder))
            made = self._process(Path(folder))
            return replace(made, folder=folder, fingerprint=mark)
        except FieldcalError as error:
            said = str(error)
            said = said if name in said else f"{name}: {said}"
        except MemoryError:
            said = f"{name}: {OUT_OF_MEMORY}; process fewer sessions at once, or"
            said += " shorten the recording"
        except Exception as error:  # one session costs no other, whatever it is
            said = (
                f"{name}: {type(error).__name__}: {error}; see fieldcal verify, or"
                " report this with the session"
            )
        return failed_session(folder, said, mark)

    def _process(self, folder: Path) -> StoredSession:
        session, repaired = repaired_session(Session.open(folder))
        still = usable_windows(session)
        prepared = PreparedSession(session, still)
        found = solve_prepared(prepared)
        found = with_repairs(found, repaired)
        given = Path(self.limits) if self.limits else None
        bounds = limits.read(session.grade, limits_path(session, given))
        if given is None and "run" not in session.about.raw:
            found = with_faults(found, session, still, bounds)
        else:
            found = assess(found, session, still, bounds, None)
        explanation = prepared.explanation
        diagnosis = None
        if explanation is not None and self.diagnose:
            diagnosis = make_diagnosis(session.block, explanation).to_json()
        taken_at, part = start_time(list(session.marks())), recorded_part(folder)
        return replace(
            session_of_calibration(folder, found, taken_at, part),
            serial=str(session.about.device.get("serial", "")),
            levels=levels_of(session.about.raw),
            diagnosis=diagnosis,
            reduced=None
            if explanation is None
            else reduce_session(explanation).to_bytes(),
        )


def failed_session(
    folder: str, error: str, fingerprint: str | None = None
) -> StoredSession:
    """Record of a session without a result, with its device as session.toml states it.

    A unit whose session failed is a unit of its lot. What session.toml does not state,
    or if it is not TOML, is unknown.
    """
    raw: Mapping[str, Any] = {}
    with suppress(FieldcalError, OSError, ValueError):
        raw = with_bare_names(
            load_toml((Path(folder) / DESCRIPTION).read_text("utf-8"))
        )
    tables = {name: t for name, t in raw.items() if isinstance(t, Mapping)}
    serial = tables.get("device", {}).get("serial", "")
    return StoredSession(
        folder, str(serial), levels_of(tables), fingerprint=fingerprint, error=error
    )


def _limits_in_plan(folder: Path) -> str:
    """Text of the limits that session.toml names; empty without any.

    What cannot be read is reported when the session is processed.
    """
    with suppress(FieldcalError, OSError, ValueError):
        raw = load_toml((folder / DESCRIPTION).read_text("utf-8"))
        if (path := planned_limits(raw)) is not None:
            return path.read_text("utf-8")
    return ""


def levels_of(raw: Mapping[str, Any]) -> dict[str, str]:
    """Levels in the tables of a session.toml: model, lot, station, operator."""
    device, site = raw.get("device", {}), raw.get("site", {})
    said = {
        "model": device.get("model"),
        "lot": device.get("lot"),
        "station": site.get("station"),
        "operator": site.get("operator"),
    }
    return {name: str(value) for name, value in said.items() if value not in (None, "")}
