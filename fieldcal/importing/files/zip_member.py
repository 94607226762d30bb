"""The one file of a .zip, read as if it stood there unpacked."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from fieldcal.core.errors import InputError
from fieldcal.importing.words.file_names import ACC, GYR

MAGIC = b"PK\x03\x04"

ADDED = ("__MACOSX/", ".DS_Store", "Thumbs.db", "desktop.ini")
"""What file managers put into archives."""

BYTES_AT_ONCE = 1 << 14
"""Bytes unpacked together; of those about a fault nothing is left."""

FAULTS = (zipfile.BadZipFile, RuntimeError, NotImplementedError, zlib.error, EOFError)
"""What an archive raises that is damaged, has a password or is packed otherwise."""


def only_member(path: Path) -> str | None:
    """Name of the one file in an archive; None if there are more, or it is no archive.

    Arrays, and files of which the name says the sensor, are left to who reads those.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            # of a name that is damaged nothing may be left, which is_dir() looks into
            names = [n for n in archive.namelist() if not n.endswith("/")]
    except (*FAULTS, OSError, ValueError):
        return None
    names = [
        n for n in names if not any(n.startswith(a) or n.endswith(a) for a in ADDED)
    ]
    if len(names) != 1 or names[0].endswith(".npy"):
        return None
    stem = Path(names[0]).stem.lower().replace(" ", "")
    return None if stem in (*ACC, *GYR) else names[0]


class ZipMember(io.RawIOBase):
    """What can be unpacked of a file in an archive.

    Parameters
    ----------
    path, name : of the archive, and of the file in it
    cut : called with the place where it fails; may raise

    """

    def __init__(self, path: Path, name: str, cut: Callable[[str, str], None]) -> None:
        self._cut, self._many = cut, 0
        self._archive = zipfile.ZipFile(path)
        try:
            self._file = cast(zipfile.ZipExtFile, self._archive.open(name))
        except FAULTS as error:
            self._archive.close()
            raise InputError(
                f"{path}: {name} in it cannot be read ({error}); unpack it, and import"
                " the file"
            ) from error

    def readable(self) -> bool:
        """Say that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer as far as the archive does."""
        try:
            data = self._file.read1(min(len(buffer), BYTES_AT_ONCE))
        except FAULTS as error:
            self._cut(
                f"behind byte {self._many}, unpacked",
                f"the archive is damaged ({error})",
            )
            return 0
        buffer[: len(data)] = data
        self._many += len(data)
        return len(data)

    def close(self) -> None:
        """Close the archive."""
        self._file.close()
        self._archive.close()
        super().close()
