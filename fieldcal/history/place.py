"""Where the store is: a file, or the address of a database."""

from __future__ import annotations

import os
from pathlib import Path

PLACE = "FIELDCAL_HISTORY"
"""Variable of the environment that names it."""

Place = str | Path
"""A SQLite file, or postgresql://user:password@host/name."""


def default_place() -> Place:
    """The store: $FIELDCAL_HISTORY, or history.sqlite among the user's data."""
    if named := os.environ.get(PLACE):
        return named if is_address(named) else Path(named)
    data = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(data) / "fieldcal" / "history.sqlite"


def is_address(place: Place) -> bool:
    """Whether a place is a database's address and no file.

    >>> is_address("postgresql://lab/imus"), is_address("lab/history.sqlite")
    (True, False)
    """
    return "://" in str(place)
