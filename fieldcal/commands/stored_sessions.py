"""Sessions of the store that a command asks for; what is left out is said."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fieldcal.history.database import Database
    from fieldcal.history.sessions import StoredSession


def find_stored_sessions(
    database: Database,
    wanted: Mapping[str, str],
    command: str,
    documents: bool = False,
) -> list[StoredSession]:
    """Find the sessions that meet all conditions, each recording once.

    Parameters
    ----------
    database : the store
    wanted : conditions by the names in `filters.FILTERS`
    command : its name in messages
    documents : whether to load results and diagnoses

    """
    from fieldcal.history.sessions import find_sessions, untimed_sentence

    some = database.run(
        lambda db: find_sessions(db, wanted, documents=documents, once=True)
    )
    if lost := database.run(lambda db: untimed_sentence(db, wanted)):
        sys.stderr.write(f"fieldcal {command}: {lost}\n")
    tell_shorter_copies(database, wanted, command)
    return some


def tell_shorter_copies(
    database: Database, wanted: Mapping[str, str], command: str
) -> None:
    """Say which copies of a run do not count, as a longer one does."""
    from fieldcal.history.repeats import copy_sentence, shorter_copies

    for pair in database.run(lambda db: shorter_copies(db, wanted)):
        sys.stderr.write(f"fieldcal {command}: {copy_sentence(*pair)}\n")
