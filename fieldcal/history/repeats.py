"""Stored sessions that use the same samples: one of them counts."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Row, and_, select, update

from fieldcal.core.recorded_part import RecordedPart
from fieldcal.history.tables import SESSION


def supersede(db: Connection, number: int, serial: str, part: RecordedPart) -> None:
    """Let one row count of all that have a result of the same samples.

    It is the new one, unless it does not name its device and another one does. Its
    calibration is accepted if one of the others was.
    """
    same = and_(
        SESSION.c.id != number,
        SESSION.c.recording == part.digest,
        SESSION.c.part_start < part.end,
        SESSION.c.part_end > part.start,
        SESSION.c.result.is_not(None),
    )
    others = db.execute(select(SESSION.c.serial, SESSION.c.accepted).where(same)).all()
    lesser = not serial and any(other.serial for other in others)
    here = update(SESSION).where(SESSION.c.id == number)
    db.execute(here.values(superseded=lesser))
    if lesser:
        return
    if any(other.accepted for other in others):
        db.execute(here.values(accepted=True))
    there = update(SESSION).where(same)
    db.execute(there.values(accepted=False, superseded=True))


def part_of_row(row: Row[Any]) -> RecordedPart | None:
    """Samples that a stored session uses; None if unknown."""
    if row.recording is None:
        return None
    return RecordedPart(row.recording, row.part_start, row.part_end)
