"""Calibrations of each device in the store, by serial number.

A calibration is stored when it is complete, and later ones are compared with it. The
store does not enter any estimate. A calibration belongs to the family of its device if
it was GO or was accepted by hand. An accepted one begins a new family, as after a
repair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.calibration import Calibration
from fieldcal.core.documents import load_json
from fieldcal.core.errors import InputError
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.history.location import StoreLocation

if TYPE_CHECKING:
    from fieldcal.history.database import Database


@dataclass(frozen=True, slots=True)
class HistoryRun:
    """One calibration in the store.

    Attributes
    ----------
    number : its number in the store
    serial : of the device
    taken_at : time of the recording, ISO 8601 in UTC; empty if unknown
    session : path of the session folder
    go : whether it was GO; None without a decision
    accepted : whether it was accepted by hand, and begins a family
    temperature : mean, deg C; None if unknown
    latitude_deg, height_m : the site; None if unknown
    software : version of fieldcal
    calibration : with its covariance
    part : samples that its session uses; None if unknown

    """

    number: int
    serial: str
    taken_at: str
    session: str
    go: bool | None
    accepted: bool
    temperature: float | None
    latitude_deg: float | None
    height_m: float | None
    software: str
    calibration: Calibration
    part: RecordedPart | None = None


def family_runs(runs: Sequence[HistoryRun]) -> tuple[HistoryRun, ...]:
    """Runs with which the next one is compared, in order."""
    begins = max((i for i, run in enumerate(runs) if run.accepted), default=0)
    return tuple(run for run in runs[begins:] if run.go or run.accepted)


def recording_time(taken_at: str | None) -> datetime | None:
    """Time of a recording as the store has it; UTC unless it states its zone.

    >>> recording_time("2026-03-01"), recording_time("")
    (datetime.datetime(2026, 3, 1, 0, 0, tzinfo=datetime.timezone.utc), None)
    """
    try:
        at = datetime.fromisoformat(taken_at or "")
    except ValueError:
        return None
    return at if at.tzinfo else at.replace(tzinfo=UTC)


def earlier_runs(
    runs: Sequence[HistoryRun],
    folder: Path,
    taken_at: str | None,
    part: RecordedPart | None = None,
) -> list[HistoryRun]:
    """Runs of other sessions that are known to be earlier than a session, in order.

    A session of unknown time counts as the newest: to compare it with too many runs may
    cost a GO, to compare it with none may give a wrong one.

    Parameters
    ----------
    runs : calibrations of the device
    folder, taken_at : of the session; None if its time is unknown
    part : samples that it uses: a copy of it is no other session; None if unknown

    """
    here, now = str(folder.resolve()), recording_time(taken_at)
    others = [
        run for run in runs
        if run.session != here
        and not (part and run.part and run.part.overlaps(part))
    ]  # fmt: skip
    if now is None:
        return others
    known = [(recording_time(run.taken_at), run) for run in others]
    return [run for at, run in known if at and at < now]


class History:
    """The calibrations in the store.

    Parameters
    ----------
    place : path of a file, created at the first write; or the address of a database

    """

    def __init__(self, place: StoreLocation) -> None:
        self.place = place

    @cached_property
    def database(self) -> Database:
        """The database; imported at first use, to save time."""
        from fieldcal.history.database import Database

        return Database(self.place)

    def add(
        self,
        taken_at: str | None,
        session: Path,
        found: Calibration,
        part: RecordedPart | None = None,
    ) -> None:
        """Store a calibration; one of the same session is replaced.

        Parameters
        ----------
        taken_at : time of the recording, ISO 8601; None if unknown
        session : its folder
        found : its calibration
        part : samples that it uses; None if unknown

        Raises
        ------
        InputError
            If the store cannot be written, or the device has no serial number.

        """
        from fieldcal.history import sessions

        document = found.to_json()
        serial = str(document.get("device", {}).get("serial", ""))
        if not serial:
            raise InputError("no history without a serial number: give --serial")
        one = sessions.session_of_calibration(session, found, taken_at, part)
        self.database.run(lambda db: sessions.store_session(db, one), write=True)

    def serials(self) -> list[tuple[str, int, str]]:
        """Serial number, number of calibrations and time of the last one, by device."""
        from sqlalchemy import func, select

        from fieldcal.history.tables import SESSION

        query = (
            select(SESSION.c.serial, func.count(), func.max(SESSION.c.taken_at))
            .where(
                SESSION.c.serial != "",
                SESSION.c.result.is_not(None),
                ~SESSION.c.superseded,
            )
            .group_by(SESSION.c.serial)
            .order_by(SESSION.c.serial)
        )
        rows = self.database.run(lambda db: db.execute(query).all())
        return [(str(s), int(n), str(last or "")) for s, n, last in rows]

    def runs(self, serial: str) -> tuple[HistoryRun, ...]:
        """All calibrations of a device, oldest first, each recording once.

        Raises
        ------
        InputError
            If the store cannot be read.

        """
        from sqlalchemy import select

        from fieldcal.history.tables import SESSION

        query = (
            select(SESSION)
            .where(
                SESSION.c.serial == serial,
                SESSION.c.result.is_not(None),
                ~SESSION.c.superseded,
            )
            .order_by(SESSION.c.taken_at.nulls_first(), SESSION.c.id)
        )
        rows = self.database.run(lambda db: db.execute(query).all())
        return tuple(self._run(row) for row in rows)

    def accept(self, serial: str, number: int) -> None:
        """Mark a calibration as accepted; it begins a new family.

        Raises
        ------
        InputError
            If the device has no such calibration.

        """
        from sqlalchemy import update

        from fieldcal.history.tables import SESSION

        change = (
            update(SESSION)
            .where(SESSION.c.id == number, SESSION.c.serial == serial)
            .values(accepted=True)
        )
        if not self.database.run(lambda db: db.execute(change).rowcount, write=True):
            raise InputError(
                f"{serial} has no calibration number {number}: see fieldcal"
                f" history {serial}"
            )

    def _run(self, row: Any) -> HistoryRun:
        from fieldcal.history.repeats import part_of_row

        try:
            found = Calibration.from_json(load_json(row.result))
        except (ValueError, InputError) as error:
            raise InputError(
                f"{self.database.location_text}: calibration {row.id} cannot be read"
                f" ({error}); move the file away, or name another with --history"
            ) from error
        return HistoryRun(
            row.id,
            row.serial,
            row.taken_at or "",
            row.folder,
            row.go,
            row.accepted,
            row.temperature,
            row.latitude_deg,
            row.height_m,
            row.software,
            found,
            part_of_row(row),
        )
