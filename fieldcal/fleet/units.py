"""Units of a lot: which session represents each, and by what name it is known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldcal.history.sessions import StoredSession


def unit_name(one: StoredSession) -> str:
    """Serial number of a unit, or the name of its folder if it has none."""
    return one.serial or Path(one.folder).name


def latest_session_per_unit(sessions: Sequence[StoredSession]) -> list[StoredSession]:
    """Return each unit's last session with a good result, or else its last session."""
    units: dict[str, StoredSession] = {}
    for one in sorted(sessions, key=_time_order):
        key = one.serial or one.folder
        before = units.pop(key, None)
        kept = before is not None and before.good and not one.good
        units[key] = before if before is not None and kept else one
    return sorted(units.values(), key=_time_order)


def is_unit(one: StoredSession) -> bool:
    """Whether a session is of a unit: nobody knows of what a broken folder is."""
    return one.good is not None or bool(one.serial)


def _time_order(one: StoredSession) -> tuple[str, str]:
    return (one.taken_at or "", one.folder)


def serials_alike(units: Sequence[StoredSession]) -> list[tuple[str, ...]]:
    """Serial numbers that differ by upper and lower case only, each group in order."""
    found: dict[str, dict[str, None]] = {}
    for one in units:
        found.setdefault(one.serial.casefold(), {})[one.serial] = None
    return [tuple(sorted(some)) for some in found.values() if len(some) > 1]
