"""Rows of numbers that are spooled to disk when they are many."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from fieldcal.core.samples import Array

IN_MEMORY = 1 << 21
"""Bytes that stay in memory."""


class SpooledRows:
    """Rows that are added one after the other and read again in any order.

    A context manager; the disk space is given back at its end.

    Parameters
    ----------
    folder : on a disk: the system's own place for such files may be memory

    """

    def __init__(self, folder: Path) -> None:
        self._file = tempfile.SpooledTemporaryFile(IN_MEMORY, dir=str(folder))
        self._rows, self._width = 0, 0

    def add(self, rows: Array) -> None:
        """Take in rows (k, width) that follow those before."""
        self._file.seek(0, 2)
        self._file.write(np.ascontiguousarray(rows, dtype=float).tobytes())
        self._rows += len(rows)
        self._width = rows.shape[1]

    def __len__(self) -> int:
        return self._rows

    def __getitem__(self, some: slice) -> Array:
        first, last, _ = some.indices(self._rows)
        size = 8 * self._width
        self._file.seek(first * size)
        data = self._file.read(max(0, last - first) * size)
        return np.frombuffer(data).reshape(-1, self._width)

    def __enter__(self) -> SpooledRows:
        return self

    def __exit__(self, *exc: object) -> None:
        self._file.close()
