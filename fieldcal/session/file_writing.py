"""Writing files: whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

from fieldcal.core.errors import SessionError, disk_says


def check_writable(path: Path) -> None:
    """Refuse a file that cannot be written, before long work whose result it takes.

    Raises
    ------
    SessionError
        If it is a folder, or nothing can be written beside it.

    """
    if path.is_dir():
        raise SessionError(f"{path}: is a folder: name a file in it")
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}."):
            pass
    except OSError as error:
        raise SessionError(f"{path}: cannot be written: {disk_says(error)}") from error


def write_atomically(path: Path, content: str | bytes) -> Path:
    """Replace a file atomically: a reader finds the old content or the new one.

    Raises
    ------
    SessionError
        If it cannot be written.

    """
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content.encode() if isinstance(content, str) else content)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(name)
            raise
    except OSError as error:
        raise SessionError(f"{path}: cannot be written: {disk_says(error)}") from error
    return path
