"""Stored sessions that use the same samples: one of them counts.

They are copies of one session, or of one run: a copy that was made before the run was
continued has fewer samples, and the longer one counts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Connection,
    Row,
    and_,
    delete,
    func,
    or_,
    select,
    update,
)

from fieldcal.core.escaping import escape_line
from fieldcal.core.file_names import storable_text
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.history.filters import condition
from fieldcal.history.tables import PARAMETER, REDUCED_ROWS, SESSION


def supersede(db: Connection, number: int, serial: str, part: RecordedPart) -> None:
    """Let one row count of all that have a result of the same samples.

    It is the new one, unless it does not name its device and another one does, or
    another one of the same run is longer. Its calibration is accepted if one of the
    others was.
    """
    same = and_(
        SESSION.c.id != number,
        _of_recording(part.digest, part.run),
        SESSION.c.part_start < part.end,
        SESSION.c.part_end > part.start,
        SESSION.c.result.is_not(None),
    )
    others = db.execute(select(SESSION).where(same)).all()
    lesser = any(_counts_instead(other, serial, part) for other in others)
    here = update(SESSION).where(SESSION.c.id == number)
    db.execute(here.values(superseded=lesser))
    if lesser:
        return
    if any(other.accepted for other in others):
        db.execute(here.values(accepted=True))
    there = update(SESSION).where(same)
    db.execute(there.values(accepted=False, superseded=True))


def _of_recording(digest: str, run: str | None) -> ColumnElement[bool]:
    """Whether a row is of the recording with a digest, or of the same run."""
    same = SESSION.c.recording == digest
    return same if run is None else or_(same, SESSION.c.run_id == run)


def _counts_instead(other: Row[Any], serial: str, part: RecordedPart) -> bool:
    """Whether a row of the same samples counts instead of one stored later."""
    if bool(other.serial) != bool(serial):
        return bool(other.serial)
    return other.recording != part.digest and (other.samples or 0) > part.samples


def replacing_folders(db: Connection) -> dict[str, list[str]]:
    """Folders of the rows that count, by the folder of the row that they replace.

    Only copies with the same samples: one of fewer would not count either way.
    """
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


def shorter_copies(
    db: Connection, wanted: Mapping[str, str] | None = None
) -> list[tuple[str, str]]:
    """Folders of rows that a longer copy of their run replaces, each with the latter.

    Only of sessions that meet all conditions, by the names in `filters.FILTERS`.
    """
    conditions = [condition(name, value) for name, value in (wanted or {}).items()]
    longer = SESSION.alias()
    query = (
        select(SESSION.c.folder, func.min(longer.c.folder))
        .where(
            SESSION.c.superseded,
            ~longer.c.superseded,
            longer.c.run_id == SESSION.c.run_id,
            longer.c.recording != SESSION.c.recording,
            longer.c.part_start < SESSION.c.part_end,
            longer.c.part_end > SESSION.c.part_start,
            *conditions,
        )
        .group_by(SESSION.c.folder)
        .order_by(SESSION.c.folder)
    )
    return [(str(own), str(other)) for own, other in db.execute(query)]


def copy_sentence(copy: str, longer: str) -> str:
    """Sentence about a copy of a run that does not count, by the folders of both."""
    return (
        f"{escape_line(copy)}: is a copy of {escape_line(longer)} with fewer samples,"
        " and does not count"
    )


def withdraw(db: Connection, folders: Sequence[str]) -> None:
    """Delete the rows of folders; what one of them superseded counts again.

    If several rows of the same samples are left, the one counts that names its device,
    of those the longest, and of those the last one. It is accepted if the deleted one
    was.
    """
    here = SESSION.c.folder.in_([storable_text(one) for one in folders])
    gone = db.execute(select(SESSION).where(here)).all()
    for table in (PARAMETER, REDUCED_ROWS):
        db.execute(delete(table).where(table.c.session.in_([row.id for row in gone])))
    db.execute(delete(SESSION).where(here))
    for row in gone:
        if row.recording is not None and not row.superseded:
            _reinstate(db, row)


def _reinstate(db: Connection, gone: Row[Any]) -> None:
    """Let rows count again that were replaced by a row which is gone."""
    recorded = _of_recording(gone.recording, gone.run_id)
    same = and_(recorded, SESSION.c.result.is_not(None))
    length = func.coalesce(SESSION.c.samples, 0)
    order = (
        SESSION.c.superseded, SESSION.c.serial == "", length.desc(),
        SESSION.c.id.desc(),
    )  # fmt: skip
    counting: list[RecordedPart] = []
    for row in db.execute(select(SESSION).where(same).order_by(*order)).all():
        part = part_of_row(row)
        if part is None or any(part.overlaps(one) for one in counting):
            continue
        counting.append(part)
        if row.superseded:
            values = {"superseded": False, "accepted": bool(gone.accepted)}
            db.execute(update(SESSION).where(SESSION.c.id == row.id).values(**values))


def part_of_row(row: Row[Any]) -> RecordedPart | None:
    """Samples that a stored session uses; None if unknown."""
    if row.recording is None:
        return None
    return RecordedPart(
        row.recording, row.part_start, row.part_end, row.samples or 0, row.run_id
    )
