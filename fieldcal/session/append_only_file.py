"""A file that grows by whole pieces only."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


class AppendOnlyFile:
    """A file to which whole pieces are appended.

    Parameters
    ----------
    path : of the file
    size : bytes of it to keep; None creates it, or raises FileExistsError

    """

    def __init__(self, path: Path, size: int | None = None) -> None:
        how = os.O_WRONLY | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
        self.fd = os.open(path, how | (os.O_EXCL if size is None else 0), 0o644)
        self._size = size or 0
        os.ftruncate(self.fd, self._size)

    def append(self, data: bytes) -> None:
        """Write all of it, or nothing and raise OSError."""
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self.fd, left) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self.fd, self._size)
            raise
        self._size += len(data)

    def sync(self) -> None:
        """Write to the disk what the operating system has."""
        os.fsync(self.fd)

    def close(self) -> None:
        """Close it; it cannot be used any more."""
        os.close(self.fd)
