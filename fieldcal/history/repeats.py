"""Stored sessions that use the same samples: one of them counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, Row, and_, delete, select, update

from fieldcal.core.file_names import storable_text
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.history.tables import PARAMETER, REDUCED_ROWS, SESSION


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


def replacing_folders(db: Connection) -> dict[str, list[str]]:
    """Folders of the rows that count, by the folder of the row that they replace."""
    own, other = SESSION.alias(), SESSION.alias()
    query = select(own.c.folder, other.c.folder).where(
        own.c.superseded,
        ~other.c.superseded,
        other.c.recording == own.c.recording,
        other.c.part_start < own.c.part_end,
        other.c.part_end > own.c.part_start,
    )
    found: dict[str, list[str]] = {}
    for folder, instead in db.execute(query):
        found.setdefault(folder, []).append(instead)
    return found


def withdraw(db: Connection, folders: Sequence[str]) -> None:
    """Delete the rows of folders; what one of them superseded counts again.

    If several rows of the same samples are left, the one counts that names its device,
    and of those the last one. It is accepted if the deleted one was.
    """
    here = SESSION.c.folder.in_([storable_text(one) for one in folders])
    gone = db.execute(select(SESSION).where(here)).all()
    for table in (PARAMETER, REDUCED_ROWS):
        db.execute(delete(table).where(table.c.session.in_([row.id for row in gone])))
    db.execute(delete(SESSION).where(here))
    for row in gone:
        if row.recording is not None and not row.superseded:
            _reinstate(db, row.recording, bool(row.accepted))


def _reinstate(db: Connection, recording: str, accepted: bool) -> None:
    """Let rows of a recording count again that no row replaces any more."""
    same = and_(SESSION.c.recording == recording, SESSION.c.result.is_not(None))
    order = (SESSION.c.superseded, SESSION.c.serial == "", SESSION.c.id.desc())
    counting: list[RecordedPart] = []
    for row in db.execute(select(SESSION).where(same).order_by(*order)).all():
        part = part_of_row(row)
        if part is None or any(part.overlaps(one) for one in counting):
            continue
        counting.append(part)
        if row.superseded:
            values = {"superseded": False, "accepted": accepted}
            db.execute(update(SESSION).where(SESSION.c.id == row.id).values(**values))


def part_of_row(row: Row[Any]) -> RecordedPart | None:
    """Samples that a stored session uses; None if unknown."""
    if row.recording is None:
        return None
    return RecordedPart(row.recording, row.part_start, row.part_end)
