"""Samples of an import on disk: written group by group, found again by their time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fieldcal.core.samples import CHANNELS, Block, concat

MIN_GROUP_ROWS, MAX_GROUP_ROWS = 1 << 13, 1 << 15
"""Fewest and most rows of a row group."""


class SampleWriter:
    """A samples.parquet that is written piece by piece, and read back by time.

    A context manager; memory holds one group of rows.
    """

    def __init__(self, path: Path) -> None:
        import pyarrow.parquet

        from fieldcal.session.sample_table import samples_schema

        self._path = path
        # no two samples are alike: a dictionary of them only takes time
        self._writer = pyarrow.parquet.ParquetWriter(
            path,
            samples_schema(),
            compression="lz4",
            use_dictionary=False,
            use_byte_stream_split=True,
            write_statistics=False,
            write_page_checksum=True,
        )
        self._waiting: list[Block] = []
        self._many = 0
        self._groups: list[tuple[float, float]] = []
        self._file: Any = None
        self._read = (-1, concat([]))

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        self._waiting.append(block)
        self._many += len(block)
        if self._many >= MIN_GROUP_ROWS:
            self._put()

    def _put(self) -> None:
        """Write the rows that wait, in groups."""
        from fieldcal.session.sample_table import to_record_batch

        one = len(self._waiting) == 1
        whole = self._waiting[0] if one else concat(self._waiting)
        self._waiting, self._many = [], 0
        for first in range(0, len(whole), MAX_GROUP_ROWS):
            part = whole[first : first + MAX_GROUP_ROWS]
            self._writer.write_batch(
                to_record_batch(part, nulls=True), row_group_size=MAX_GROUP_ROWS
            )
            self._groups.append((float(part.t[0]), float(part.t[-1])))

    def close(self) -> None:
        """Write what waits, and end the file."""
        if self._many:
            self._put()
        self._writer.close()

    def between(self, start: float, end: float) -> Iterator[Block]:
        """Times and channels with start <= t < end, of a file that was closed."""
        for i, (first, last) in enumerate(self._groups):
            if first < end and last >= start:
                yield self._group(i).between(start, end)

    def _group(self, i: int) -> Block:
        """One group of rows; stretches that follow each other are in one."""
        import pyarrow.parquet

        from fieldcal.session.sample_table import block_from_table

        if self._file is None:
            self._file = pyarrow.parquet.ParquetFile(self._path, pre_buffer=False)
        if self._read[0] != i:
            # one thread: each of several would keep memory of its own
            group = self._file.read_row_group(i, ("t", *CHANNELS), use_threads=False)
            self._read = (i, block_from_table(group))
        return self._read[1]

    def __enter__(self) -> SampleWriter:
        return self

    def __exit__(self, *exc: object) -> None:
        self._writer.close()
        if self._file is not None:
            self._file.close()


def file_record(path: Path) -> dict[str, Any]:
    """Name, size and SHA-256 of a file."""
    import hashlib

    with path.open("rb") as file:
        hashed = hashlib.file_digest(file, "sha256")
    return {
        "name": path.name, "sha256": hashed.hexdigest(), "bytes": path.stat().st_size
    }  # fmt: skip
