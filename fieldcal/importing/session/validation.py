"""Validation of imported samples: bad rows are left out, good ones written.

A row is refused whose time is not later than that of the row before, whose numbers are
infinite or larger than any sensor's, or which holds nothing but zeros (a buffer that
was never filled): a missing value is no zero. Rows without any number are no samples,
and are left out as if they were not there. Rows are written a group at a time, and
found again by their time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block, concat
from fieldcal.importing.recording import LARGEST, MOST

FEWEST, GROUP = 1 << 13, 1 << 15
"""Fewest and most rows of a row group."""

Rows = NDArray[np.bool_]


class RowValidator:
    """Validates rows block by block.

    Parameters
    ----------
    name : of the file, for errors
    place : names a row, counted from 0
    repair : whether bad rows are left out and said, or refused

    """

    def __init__(self, name: str, place: Callable[[int], str], repair: bool) -> None:
        self._name, self._place, self._repair = name, place, repair
        self._seen, self._last = 0, -np.inf
        self._runs: list[tuple[str, str, int, int]] = []
        self._more = [0, 0]
        self.left_out = 0

    @property
    def mended(self) -> list[str]:
        """Rows left out, a sentence for each run."""
        says = [self._sentence(*run) for run in self._runs[:MOST]]
        if len(self._runs) > MOST:
            places, rows = self._more[0] + 1, self._more[1] + self._runs[MOST][3]
            says.append(f"{rows} more rows in {places} more places")
        return [f"{sentence}, left out" for sentence in says]

    def good(self, block: Block) -> Block:
        """Return the rows that can be used.

        Raises
        ------
        InputError
            For the first row that cannot, where no repair was asked for; names file,
            row and column.

        """
        if not len(block):
            return block
        bad = np.zeros(len(block), dtype=bool)
        for column, what, rows in self._faults(block):
            self._note(column, what, rows & ~bad)
            bad |= rows
        bad |= self._backwards(block.t, bad)
        self._seen += len(block)
        left = bad | _without_numbers(block)
        if not left.any():
            return block
        if bad.any() and not self._repair:
            raise InputError(
                f"{self._name}: {self._sentence(*self._runs[0])}; mend the file, or"
                " leave such rows out with --repair"
            )
        self.left_out += int(bad.sum())
        parts = np.split(np.arange(len(block)), np.flatnonzero(np.diff(left)) + 1)
        return concat(block[r[0] : r[-1] + 1] for r in parts if not left[r[0]])

    def _faults(self, block: Block) -> Iterator[tuple[str, str, Rows]]:
        empty = _all_zero(block)
        if empty.any():
            columns = " ".join(
                CHANNELS if np.isfinite(block.gyr).any() else CHANNELS[:3]
            )
            later = self._seen + np.arange(len(block)) > 0
            unstamped = empty & (block.t == 0) & later
            yield f"t {columns}", "hold only zeros", unstamped
            yield columns, "hold only zeros", empty & ~unstamped
        timeless = ~np.isfinite(block.t)
        if timeless.any():
            yield "t", "is no time", timeless
        for names, triad in ((CHANNELS[:3], block.acc), (CHANNELS[3:], block.gyr)):
            wild = np.abs(triad) > LARGEST
            if wild.any():
                infinite = np.isinf(triad)
                for what, rows in (
                    ("is infinite", infinite),
                    ("is larger than any sensor's", wild & ~infinite),
                ):
                    for i in np.flatnonzero(rows.any(axis=0)):
                        yield names[i], what, rows[:, i]

    def _backwards(self, t: Array, bad: Rows) -> Rows:
        """Rows that are not later than all good ones before them."""
        times = t[~bad] if bad.any() else t
        if not len(times):
            return np.zeros(len(t), dtype=bool)
        if times[0] > self._last and (times[1:] > times[:-1]).all():
            self._last = float(times[-1])
            return np.zeros(len(t), dtype=bool)
        rest = np.flatnonzero(~bad)
        # one time that leaps ahead is wrong itself, not all that come after it
        ahead = np.zeros(len(times), dtype=bool)
        before = np.concatenate([[self._last], times[:-1]])[:-1]
        ahead[:-1] = (times[:-1] > times[1:]) & (times[1:] > before)
        newest = np.maximum.accumulate(
            np.concatenate([[self._last], np.where(ahead, -np.inf, times)])
        )
        late = ~ahead & (times <= newest[:-1])
        out = np.zeros(len(t), dtype=bool)
        for which, what in (
            (late, "is not later than above"),
            (ahead, "is later than below"),
        ):
            rows = np.zeros(len(t), dtype=bool)
            rows[rest[which]] = True
            self._note("t", what, rows)
            out |= rows
        self._last = float(newest[-1])
        return out

    def _note(self, column: str, what: str, rows: Rows) -> None:
        edges = np.flatnonzero(np.diff(rows.astype(int), prepend=0, append=0))
        for start, end in edges.reshape(-1, 2).tolist():
            first, count = self._seen + start, end - start
            if self._runs:
                *same, begin, n = self._runs[-1]
                if same == [column, what] and begin + n == first:
                    self._runs[-1] = (column, what, begin, n + count)
                    continue
            if len(self._runs) > MOST:
                # of a log that is bad all over, only the number of its faults is kept
                self._more[0] += 1
                self._more[1] += self._runs.pop()[3]
            self._runs.append((column, what, first, count))

    def _sentence(self, column: str, what: str, first: int, count: int) -> str:
        rows = self._place(first)
        if count > 1:
            rows += f" to {self._place(first + count - 1)}"
        return f"{rows}, column {column}: {what}"


def _all_zero(block: Block) -> Rows:
    """Whether rows consist of zeros only; missing rates are ignored."""
    empty: Rows = block.acc[:, 0] == 0
    some = np.flatnonzero(empty)
    zeros = (block.acc[some] == 0).all(axis=1)
    empty[some] = zeros & ((block.gyr[some] == 0) | np.isnan(block.gyr[some])).all(
        axis=1
    )
    return empty


def _without_numbers(block: Block) -> Rows:
    """Whether rows have no value of any sensor."""
    none: Rows = np.isnan(block.acc[:, 0])
    if none.any():
        none &= np.isnan(block.six).all(axis=1) & np.isnan(block.temperature)
    return none


class SampleWriter:
    """A samples.parquet that is written piece by piece, and read back by time.

    A context manager; memory holds one group of rows.
    """

    def __init__(self, path: Path) -> None:
        import pyarrow.parquet

        from fieldcal.session.sample_files import samples_schema

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
        if self._many >= FEWEST:
            self._put()

    def _put(self) -> None:
        """Write the rows that wait, in groups."""
        from fieldcal.session.sample_files import to_record_batch

        one = len(self._waiting) == 1
        whole = self._waiting[0] if one else concat(self._waiting)
        self._waiting, self._many = [], 0
        for first in range(0, len(whole), GROUP):
            part = whole[first : first + GROUP]
            self._writer.write_batch(
                to_record_batch(part, nulls=True), row_group_size=GROUP
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

        from fieldcal.session.sample_files import block_from_table

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
