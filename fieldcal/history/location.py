"""Location of the store: a file, or the address of a database."""

from __future__ import annotations

import os
from pathlib import Path

LOCATION_VARIABLE = "FIELDCAL_HISTORY"
"""Environment variable that states the location."""

StoreLocation = str | Path
"""A SQLite file, or postgresql://user:password@host/name."""


def default_location() -> StoreLocation:
    """Location of the store: $FIELDCAL_HISTORY, or a file in the user's data folder."""
    if named := os.environ.get(LOCATION_VARIABLE):
        return named if is_address(named) else Path(named)
    data = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(data) / "fieldcal" / "history.sqlite"


def is_address(place: StoreLocation) -> bool:
    """Whether a location is the address of a database.

    >>> is_address("postgresql://lab/imus"), is_address("lab/history.sqlite")
    (True, False)
    """
    return "://" in str(place)
