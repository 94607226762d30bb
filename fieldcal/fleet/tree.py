"""Session folders in trees of folders, and the fingerprint of a session's inputs."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from fieldcal.core.errors import InputError
from fieldcal.core.version import __version__
from fieldcal.session.folder import DESCRIPTION
from fieldcal.session.marks import MARKS


def sessions_in(folders: Iterable[Path]) -> list[Path]:
    """Return the session folders below some folders, each once, in order.

    Raises
    ------
    InputError
        If a folder is not there, or there is no session in any.

    """
    found: dict[Path, None] = {}
    asked = list(folders)
    for folder in asked:
        if not folder.is_dir():
            raise InputError(f"{folder}: is no folder; name one that holds sessions")
        found |= dict.fromkeys(sorted(_session_folders_below(folder)))
    if not found:
        named = ", ".join(map(str, asked))
        raise InputError(
            f"{named}: no session there, for no folder has a {DESCRIPTION}; make some"
            " with fieldcal import"
        )
    return list(found)


def _session_folders_below(folder: Path) -> Iterator[Path]:
    for place, inner, files in os.walk(folder):
        inner[:] = [name for name in inner if not name.startswith(".")]
        if DESCRIPTION in files:
            yield Path(place).resolve()


def fingerprint(folder: Path, options: str = "") -> str:
    """Hash of a session's inputs, the version of the program and the options.

    Of the samples, which may be large, only name, size and time of change count.
    """
    made = hashlib.sha256(f"{__version__}\n{options}\n".encode())
    for path in sorted(folder.iterdir()):
        if path.name in (DESCRIPTION, MARKS):
            made.update(path.read_bytes())
        elif path.name.startswith("samples"):
            at = path.stat()
            made.update(f"{path.name} {at.st_size} {at.st_mtime_ns}\n".encode())
    return made.hexdigest()
