"""Sessions in the store: the record of one, and functions that store and find them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import (
    Connection,
    Row,
    and_,
    delete,
    func,
    insert,
    select,
    update,
)

from fieldcal.calibration import Calibration
from fieldcal.core.file_names import storable_text
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.core.samples import Array
from fieldcal.history.filters import LEVELS, TIMES, condition
from fieldcal.history.repeats import part_of_row, supersede
from fieldcal.history.tables import PARAMETER, REDUCED_ROWS, SESSION


@dataclass(frozen=True, slots=True)
class StoredSession:
    """Record of one session.

    Attributes
    ----------
    folder : path of the session
    serial : of the device, empty where unknown
    levels : properties shared with other sessions, by the names in `LEVELS`
    taken_at : time of the recording, ISO 8601 in UTC; None if unknown
    go : the decision; None if there is none
    good : whether its values may be used; None if there are none
    result, diagnosis : documents of those names
    parameters : value, standard uncertainty and unit by full name
    fingerprint : fingerprint of the session's files
    error : why there is no result, or none for the present files
    reduced : reduced rows for effects that it may share with other sessions
    part : samples that it uses; None if unknown

    """

    folder: str
    serial: str = ""
    levels: Mapping[str, str] = field(default_factory=dict)
    taken_at: str | None = None
    go: bool | None = None
    good: bool | None = None
    result: Mapping[str, Any] | None = None
    diagnosis: Mapping[str, Any] | None = None
    parameters: Mapping[str, tuple[float, float, str]] = field(default_factory=dict)
    fingerprint: str | None = None
    error: str | None = None
    reduced: bytes | None = None
    part: RecordedPart | None = None


def session_of_calibration(
    folder: Path,
    found: Calibration,
    taken_at: str | None,
    part: RecordedPart | None = None,
) -> StoredSession:
    """Record of a session with its calibration only.

    Its parameters exclude information from its lot, so that a lot is not estimated from
    itself.
    """
    document = found.to_json()
    device = document.get("device", {})
    decision = document.get("decision")
    return StoredSession(
        str(folder.resolve()),
        str(device.get("serial", "")),
        {},
        taken_at,
        None if decision is None else bool(decision.get("go", False)),
        found.good,
        document,
        parameters=_parameters_without_lot(found),
        part=part,
    )


def _parameters_without_lot(found: Calibration) -> dict[str, tuple[float, float, str]]:
    """Parameters with ± and unit, without the information from the device's lot."""
    rows = zip(found.values.tolist(), found.sigma.tolist(), found.units, strict=True)
    out = dict(zip(found.names, rows, strict=True))
    told = found.info.get("borrowed", {})
    if told and not told["refused"]:
        for name, one in told["parameters"].items():
            _, sigma, unit = out.pop(name)
            if one["own_sigma"] is not None:
                later = max(sigma**2 - one["sigma"] ** 2, 0.0)  # rounding
                own = (one["own_sigma"] ** 2 + later) ** 0.5
                out[name] = (one["own_value"], own, unit)
    return out


def store_session(db: Connection, one: StoredSession) -> None:
    """Store a session; an earlier one of the same folder is replaced.

    A folder is one session, also if its serial number was corrected. An error replaces
    no result: it is stored in addition. Of several folders with the same samples, one
    counts (`repeats`).
    """
    error = None if one.error is None else storable_text(one.error)
    one = replace(one, folder=storable_text(one.folder), error=error)
    here = SESSION.c.folder == one.folder
    if one.result is None:
        row = {"fingerprint": one.fingerprint, "error": one.error}
        has_result = and_(here, SESSION.c.result.is_not(None))
        if db.execute(update(SESSION).where(has_result).values(row)).rowcount:
            return
    number = _replaced_row(db, here, _row(one))
    if one.part is not None and one.result is not None:
        supersede(db, number, one.serial, one.part)
    rows = [
        {"session": number, "name": n, "value": v, "sigma": s, "unit": u}
        for n, (v, s, u) in one.parameters.items()
    ]
    if rows:
        db.execute(insert(PARAMETER), rows)
    if one.reduced is not None:
        db.execute(insert(REDUCED_ROWS).values(session=number, data=one.reduced))


def _replaced_row(db: Connection, here: Any, row: Mapping[str, Any]) -> int:
    """Number of the row of a folder, made or replaced; it has no parameters yet."""
    number: int | None = db.execute(select(SESSION.c.id).where(here)).scalar()
    if number is None:
        new = {**row, "accepted": False, "superseded": False}
        made: Any = db.execute(insert(SESSION).values(**new))
        return int(made.inserted_primary_key[0])
    db.execute(delete(PARAMETER).where(PARAMETER.c.session == number))
    db.execute(delete(REDUCED_ROWS).where(REDUCED_ROWS.c.session == number))
    db.execute(update(SESSION).where(SESSION.c.id == number).values(**row))
    return number


def _row(one: StoredSession) -> dict[str, Any]:
    result = one.result or {}
    conditions, site = result.get("conditions", {}), result.get("site", {})
    return {
        "serial": one.serial,
        "folder": one.folder,
        **{name: one.levels.get(name) for name in LEVELS},
        "taken_at": one.taken_at,
        "go": one.go,
        "good": one.good,
        "temperature": conditions.get("temperature_degc"),
        "latitude_deg": conditions.get("latitude_deg"),
        "height_m": site.get("height_m"),
        "software": str(result.get("software", "")),
        "fingerprint": one.fingerprint,
        "recording": None if one.part is None else one.part.digest,
        "part_start": None if one.part is None else one.part.start,
        "part_end": None if one.part is None else one.part.end,
        "samples": None if one.part is None else one.part.samples,
        "run_id": None if one.part is None else one.part.run,
        "error": one.error,
        "result": json.dumps(one.result) if one.result is not None else None,
        "diagnosis": json.dumps(one.diagnosis) if one.diagnosis is not None else None,
    }


def fingerprints(db: Connection) -> dict[str, str]:
    """Fingerprint of each folder's stored session."""
    rows = db.execute(select(SESSION.c.folder, SESSION.c.fingerprint))
    return {folder: mark for folder, mark in rows if mark is not None}


def find_sessions(
    db: Connection,
    wanted: Mapping[str, str] | None = None,
    folders: Iterable[str] | None = None,
    documents: bool = False,
    reduced: bool = False,
    once: bool = False,
) -> list[StoredSession]:
    """Stored sessions that meet all conditions, the oldest first.

    Parameters
    ----------
    db : the store
    wanted : conditions by the names in `filters.FILTERS`; `since` and `until` are dates
    folders : only sessions in these folders, if given
    documents : whether to load result and diagnosis
    reduced : whether to load reduced rows
    once : whether to leave out sessions that another one with the same samples replaces

    """
    some = [condition(name, value) for name, value in (wanted or {}).items()]
    if folders is not None:
        some.append(SESSION.c.folder.in_([*map(storable_text, folders)]))
    if once:
        some.append(~SESSION.c.superseded)
    columns = [c for c in SESSION.c if c.name not in ("result", "diagnosis")]
    columns += [SESSION.c.result, SESSION.c.diagnosis] if documents else []
    query = select(*columns).where(and_(True, *some))
    query = query.order_by(SESSION.c.taken_at.nulls_first(), SESSION.c.folder)
    rows = db.execute(query).all()
    parameters = _parameters(db, some)
    kept: dict[int, bytes] = {}
    if reduced:
        blobs = select(REDUCED_ROWS).join(SESSION).where(and_(True, *some))
        kept = {r.session: r.data for r in db.execute(blobs)}
    return [_session_of_row(r, parameters.get(r.id, {}), kept.get(r.id)) for r in rows]


def names_in_store(db: Connection, level: str) -> list[str]:
    """Names that sessions in the store state of a level, or their serial numbers."""
    column = SESSION.c[level]
    query = select(column).distinct().where(column.is_not(None), column != "")
    return sorted(str(name) for name in db.execute(query).scalars())


def untimed_sentence(db: Connection, wanted: Mapping[str, str]) -> str:
    """Sentence about sessions of unknown time that `since` and `until` leave out."""
    others = [condition(n, value) for n, value in wanted.items() if n not in TIMES]
    if len(others) == len(wanted):
        return ""
    others.append(~SESSION.c.superseded)
    query = select(func.count()).where(SESSION.c.taken_at.is_(None), *others)
    count = db.execute(query).scalar_one()
    return f"sessions of unknown time that are left out: {count}" if count else ""


def _parameters(
    db: Connection, some: list[Any]
) -> dict[int, dict[str, tuple[float, float, str]]]:
    query = select(PARAMETER).join(SESSION).where(and_(True, *some))
    out: dict[int, dict[str, tuple[float, float, str]]] = {}
    for session, name, value, sigma, unit in db.execute(query):
        out.setdefault(session, {})[name] = (value, sigma, unit)
    return out


def _session_of_row(
    row: Row[Any],
    parameters: Mapping[str, tuple[float, float, str]],
    reduced: bytes | None,
) -> StoredSession:
    result, diagnosis = (
        json.loads(text) if (text := getattr(row, name, None)) else None
        for name in ("result", "diagnosis")
    )
    levels = {n: getattr(row, n) for n in LEVELS if getattr(row, n) is not None}
    return StoredSession(
        row.folder,
        row.serial,
        levels,
        row.taken_at,
        row.go,
        row.good,
        result,
        diagnosis,
        parameters,
        row.fingerprint,
        row.error,
        reduced,
        part_of_row(row),
    )


def without_repeats(
    some: Iterable[StoredSession],
) -> tuple[list[StoredSession], list[tuple[StoredSession, StoredSession]]]:
    """Sessions of which no two use the same samples, and those that are left out.

    Each of the latter stands with the one that is used instead: the one of more
    samples, else the first.
    """
    some = list(some)
    kept: list[StoredSession] = []
    left_out: list[tuple[StoredSession, StoredSession]] = []
    for one in sorted(some, key=lambda one: -(one.part.samples if one.part else 0)):
        for other in kept:
            if one.part and other.part and other.part.overlaps(one.part):
                left_out.append((one, other))
                break
        else:
            kept.append(one)
    return [one for one in some if any(one is other for other in kept)], left_out


def parameter_values(
    sessions: Iterable[StoredSession], name: str
) -> tuple[Array, Array]:
    """Value and ± of a parameter in each session, (n,) each; nan without a value."""
    missing = (np.nan, np.nan, "")
    rows = [one.parameters.get(name, missing)[:2] for one in sessions]
    value, sigma = np.array(rows, dtype=float).reshape(-1, 2).T
    return value, sigma
