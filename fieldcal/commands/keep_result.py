"""Writes a result into its session after it was shown.

The folder may be that of an archive or of a card that nobody may write on: what was
calculated is then on the screen all the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import InputError, SessionError

if TYPE_CHECKING:
    from fieldcal.session.folder import Session


def keep_result(session: Session, name: str, content: Mapping[str, Any]) -> Path:
    """Write a document that was shown already to the session; return its path.

    Raises
    ------
    InputError
        If the folder cannot be written; it says that what was shown is not kept.

    """
    try:
        return session.write_json(name, content)
    except SessionError as error:
        said, _, _ = str(error).rpartition(": name another")
        kept = InputError(
            f"{said or error}; what is shown holds, and is not kept: copy the session"
            " to where you may write"
        )
        kept.printed = True
        raise kept from error
