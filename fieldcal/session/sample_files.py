"""Files of raw samples: .arrows (as fieldcal records them), .csv, .csv.gz, .parquet.

A file that was cut off is read up to the last whole row, with a warning. Other faults
(rows out of order, text in place of a number, no rows) are errors that name the file,
the row and the column. Rows are counted from 1, without the row of names.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fieldcal.core.errors import SessionError
from fieldcal.core.samples import Array, Block
from fieldcal.session.arrow_columns import float_values
from fieldcal.session.arrow_stream import batches_before_damage, decode_stream
from fieldcal.session.stream_damage import no_samples_text
from fieldcal.session.text_files import (
    SAMPLE_COLUMNS,
    iterate_text_batches,
    read_text_table,
)

if TYPE_CHECKING:
    import pyarrow as pa
from fieldcal.session.sample_table import block_from_columns, samples_schema

ENDINGS = (".arrows", ".parquet", ".csv", ".csv.gz")

ROWS_AT_ONCE = 1 << 17
"""Largest number of rows in a part."""

BYTES_AT_ONCE = 1 << 16
"""Bytes of a column that are read at once."""


def find_samples(folder: Path, stem: str = "samples") -> Path:
    """Find the samples file of a session folder.

    Raises
    ------
    SessionError
        If there is none, or more than one.

    """
    there = [p for e in ENDINGS if (p := folder / f"{stem}{e}").is_file()]
    if len(there) == 1:
        return there[0]
    names = " and ".join(p.name for p in there)
    raise SessionError(
        f"{folder}: both {names} are there; keep one"
        if there
        else f"{folder}: no samples file; put {stem}.csv (or .csv.gz, .parquet,"
        " .arrows) beside session.toml"
    )


class SamplesFile(NamedTuple):
    """Content of a samples file.

    Attributes
    ----------
    block : its samples, in its own units
    warnings : sentences about what was cut off or is damaged
    damaged : (start, end) of each place where samples are lost in the file, s of device
        time; no sample that is left lies in it

    """

    block: Block
    warnings: tuple[str, ...]
    damaged: tuple[tuple[float, float], ...] = ()


def read_samples(path: Path) -> SamplesFile:
    """Samples of a file.

    Raises
    ------
    SessionError
        If the file cannot be read, or does not hold samples.

    """
    try:
        table, warnings, breaks = _table(path)
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error}") from error
    columns = {name: _numbers(path, table, name) for name in table.column_names}
    del table  # an hour of samples need not be in memory three times
    _check_columns(path, columns)
    _check_rows(path, columns)
    block = block_from_columns(columns)
    t = block.t
    damaged = [(float(np.nextafter(t[i - 1], np.inf)), float(t[i])) for i in breaks]
    return SamplesFile(block, warnings, tuple(damaged))


def iterate_samples(path: Path, says: list[str] | None = None) -> Iterator[Block]:
    """Samples of a file as by `read_samples`, part by part, with bounded memory.

    Behind a damaged place, or in front of where it was cut off, all others at once.

    Parameters
    ----------
    path : the file
    says : list to which warnings about what was cut off are added

    Raises
    ------
    SessionError
        As by `read_samples`.

    """
    import pyarrow as pa

    last, rows = -np.inf, 0
    says = [] if says is None else says
    try:
        for batch in _batches(path, says):
            columns = {name: _numbers(path, batch, name) for name in batch.schema.names}
            _check_columns(path, columns)
            t = columns["t"]
            if len(t) and not (t[0] > last and (np.diff(t) > 0).all()):
                read_samples(path)  # raises an error that says where
            last = float(t[-1]) if len(t) else last
            rows += len(t)
            yield from _parts(block_from_columns(columns))
    except (pa.ArrowException, OSError):
        # raises an error that says what is wrong and where, unless its end is missing
        whole, warnings, _ = read_samples(path)
        says += warnings
        yield from _parts(whole[rows:])
        rows = len(whole)
    if not rows:
        raise SessionError(f"{path}: has no rows; record it again")


def _parts(whole: Block) -> Iterator[Block]:
    """Some rows at a time."""
    for first in range(0, len(whole), ROWS_AT_ONCE):
        yield whole[first : first + ROWS_AT_ONCE]


def _batches(path: Path, says: list[str]) -> Iterator[pa.RecordBatch]:
    """Record batches of a file of any format, with the columns of samples."""
    if path.name.endswith(".arrows"):
        yield from _stream_batches(path, says)
    elif path.name.endswith(".parquet"):
        import pyarrow.parquet

        whole = pyarrow.parquet.ParquetFile(
            path, page_checksum_verification=True,
            # what it reads ahead it keeps until the end: all of the file
            pre_buffer=False, buffer_size=BYTES_AT_ONCE,
        )  # fmt: skip
        if not _metadata_is_consistent(whole.metadata):
            read_samples(path)  # raises an error that says so
        names = [n for n in whole.schema_arrow.names if n in SAMPLE_COLUMNS]
        yield from whole.iter_batches(batch_size=ROWS_AT_ONCE, columns=names)
    else:
        yield from iterate_text_batches(path)


def _stream_batches(path: Path, says: list[str]) -> Iterator[pa.RecordBatch]:
    """Batches of a stream; after a damaged place, all intact rows at once."""
    import pyarrow as pa

    rows = 0
    with pa.OSFile(str(path)) as source:
        batches = batches_before_damage(source)
        while True:
            try:
                batch = next(batches)
            except StopIteration as end:
                finished = bool(end.value)
                break
            rows += batch.num_rows
            yield batch
    if not finished or not rows:
        table, warnings, _ = _read_arrows(path)
        says += warnings
        yield from table.slice(rows).to_batches()


def _table(path: Path) -> tuple[pa.Table, tuple[str, ...], tuple[int, ...]]:
    """All rows, warnings, and in front of which rows others are lost."""
    if path.name.endswith(".arrows"):
        return _read_arrows(path)
    if path.name.endswith(".parquet"):
        return _read_parquet(path), (), ()
    return *read_text_table(path), ()


def _read_arrows(path: Path) -> tuple[pa.Table, tuple[str, ...], tuple[int, ...]]:
    import pyarrow as pa

    data = path.read_bytes()
    found = decode_stream(data, samples_schema())
    if found.schema is None or not found.batches:
        raise SessionError(f"{path}: {no_samples_text(data)}")
    table = pa.Table.from_batches(found.batches, found.schema)
    says = tuple(f"{path.name}: {sentence}" for sentence in found.faults)
    return table, says, found.breaks


def _read_parquet(path: Path) -> pa.Table:
    import pyarrow as pa
    import pyarrow.parquet

    try:
        # its read_table loads all that reads many files as one, pandas too if installed
        file = pyarrow.parquet.ParquetFile(path, page_checksum_verification=True)
        table = file.read()
        if not _metadata_is_consistent(file.metadata):
            raise pa.ArrowInvalid(
                "what it says of its rows and columns is contradictory"
            )
        # no checksum covers the names: what was changed there may be no text
        return table.select([n for n in table.column_names if n in SAMPLE_COLUMNS])
    except MemoryError as error:  # also of a damaged size, which nothing checks
        raise SessionError(
            f"{path}: needs more memory than there is, or is damaged; copy it again, or"
            " shorten the recording"
        ) from error
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        if isinstance(error, OSError) and error.errno:
            raise
        raise SessionError(
            f"{path}: is not a whole Parquet file; copy it again from where it came"
        ) from error


def _metadata_is_consistent(about: Any) -> bool:
    """Whether the metadata of a Parquet file are consistent; no checksum covers them.

    All numbers of rows must agree, and no two columns may have one name.
    """
    names, rows = [n for n in about.schema.names if n in SAMPLE_COLUMNS], 0
    if len(set(names)) < len(names):
        return False
    for i in range(about.num_row_groups):
        group = about.row_group(i)
        parts = [group.column(j) for j in range(group.num_columns)]
        many = {p.num_values for p in parts if p.path_in_schema in SAMPLE_COLUMNS}
        if not many <= {group.num_rows}:
            return False
        rows += group.num_rows
    return bool(rows == about.num_rows)


def _numbers(path: Path, table: pa.Table | pa.RecordBatch, name: str) -> Array:
    import pyarrow as pa

    column = table.column(name)
    if name not in SAMPLE_COLUMNS:
        return np.empty(0)
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise SessionError(f"{path}: column {name} holds {column.type}, not numbers")
    if (
        column.type != pa.float64()
    ):  # casting imports Arrow's compute functions, which takes long
        column = column.cast(pa.float64())
    return float_values(column)


def _check_columns(path: Path, columns: dict[str, Array]) -> None:
    if "t" not in columns:
        raise SessionError(f"{path}: has no column t; it holds the device time in s")
    for triad in (("ax", "ay", "az"), ("gx", "gy", "gz")):
        missing = [c for c in triad if c not in columns]
        if 0 < len(missing) < 3:
            raise SessionError(
                f"{path}: has no column {missing[0]}, but the other axes"
            )
    if "ax" not in columns and "gx" not in columns:
        raise SessionError(
            f"{path}: has neither accelerometers (ax ay az) nor gyroscopes"
        )


def _check_rows(path: Path, columns: dict[str, Array]) -> None:
    t = columns["t"]
    if not len(t):
        raise SessionError(f"{path}: has no rows; record it again")
    for name, values in columns.items():
        bad = np.isinf(values) if name != "t" else ~np.isfinite(values)
        if bad.any():
            row = int(np.argmax(bad))
            raise SessionError(
                f"{path}: row {row + 1}, column {name}: {values[row]} is not a number"
                " one can calculate with; mend or remove that row"
            )
    back = np.diff(t) <= 0
    if back.any():
        row = int(np.argmax(back))
        how = "the same time as" if t[row + 1] == t[row] else "before"
        raise SessionError(
            f"{path}: row {row + 2}, column t: {t[row + 1]:g} s is {how} the row above"
            f" ({t[row]:g} s); put the rows in time order, each time once"
        )
