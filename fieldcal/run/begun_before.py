"""An earlier run in the folder of a new one, which ended before a position was taken.

An operator who began with a wrong mounting or unit is told to begin again with another
one. The same command with that option must then be enough: it would find its own folder
occupied by a recording from which nothing was taken. That recording is moved aside, not
deleted. A session with a position is never touched.
"""

from __future__ import annotations

from contextlib import suppress
from itertools import count
from pathlib import Path

from fieldcal.core.errors import FieldcalError
from fieldcal.session.folder import DESCRIPTION, Session
from fieldcal.session.lock import LOCK, OWNER, SessionLock
from fieldcal.session.marks import MARKS, read_marks
from fieldcal.session.recorder import SAMPLES

ASIDE = "before"
"""Word behind the folder's name in that of the folder it is moved to."""

OWN_FILES = {DESCRIPTION, SAMPLES, MARKS, LOCK, OWNER}
"""Files of a run that took no position."""


def set_untaken_aside(folder: Path) -> Path | None:
    """Move the recording of a run that took no position out of the way of a new run.

    Returns where it is now; None if nothing was moved: there is none, it has a
    position, no run recorded it, one is recording it, something else is in its folder,
    or it cannot be moved.
    """
    try:
        recorded = "run" in Session.open(folder).about.raw
        if not recorded or not _is_of_a_run_only(folder) or has_taken_position(folder):
            return None
        SessionLock(folder).release()  # a run in progress holds it
        aside = _free_name(folder)
        folder.rename(aside)
    except (FieldcalError, OSError, ValueError):
        return None
    return aside


def has_taken_position(folder: Path) -> bool:
    """Whether a position of a session was taken, or that can no longer be read."""
    with suppress(FieldcalError):
        damaged: list[str] = []
        events = {mark.get("event") for mark in read_marks(folder / MARKS, damaged)}
        return "window" in events or bool(damaged)
    return True


def _is_of_a_run_only(folder: Path) -> bool:
    """Whether a folder holds the files of a run, also of further devices, alone."""
    there = list(folder.iterdir())
    further = [p for p in there if p.is_dir() and (p / DESCRIPTION).exists()]
    inside = [*there, *(file for each in further for file in each.iterdir())]
    return all(p.name in OWN_FILES or p in further for p in inside)


def _free_name(folder: Path) -> Path:
    """A path beside the folder that is not there yet.

    Raises
    ------
    ValueError
        If the folder is named by dots only.

    """
    for number in count(1):
        aside = folder.with_name(f"{folder.name}-{ASIDE}-{number}")
        if not aside.exists():
            return aside
    raise AssertionError("count() does not end")
