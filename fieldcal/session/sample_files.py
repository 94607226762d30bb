"""Files of raw samples: .arrows (what the tool records), .csv, .csv.gz, .parquet.

A file that was cut off while it was written is read up to the last whole row, and the
cut is reported; what is wrong otherwise (rows out of order, text where a number
belongs, no rows at all) is an error that names the file, the row and the column. Rows
are counted from 1, the row of names not among them.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcal.core.errors import SessionError
from fieldcal.core.samples import Array, Block
from fieldcal.session.arrow_columns import numbers
from fieldcal.session.arrow_stream import decode, in_order
from fieldcal.session.text_files import COLUMNS, read_text, rows_of_text

if TYPE_CHECKING:
    import pyarrow as pa

ENDINGS = (".arrows", ".parquet", ".csv", ".csv.gz")

PART = 1 << 17
"""Rows that are handed over together, at most."""

READ_AT_ONCE = 1 << 16
"""Bytes of a column that are read together."""


def find(folder: Path, stem: str = "samples") -> Path:
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


def read(path: Path) -> tuple[Block, tuple[str, ...]]:
    """Samples of a file, unscaled, and warnings about what was cut off.

    Raises
    ------
    SessionError
        If the file cannot be read, or what it says makes no sense as samples.

    """
    try:
        table, warnings = _table(path)
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {error}") from error
    columns = {name: _numbers(path, table, name) for name in table.column_names}
    del table  # an hour of samples need not be in memory three times
    _check_columns(path, columns)
    _check_rows(path, columns)
    return _block(columns), warnings


def blocks(path: Path) -> Iterator[Block]:
    """Samples of a file as `read` has them, part by part, however long it is.

    Raises
    ------
    SessionError
        As `read` does.

    """
    import pyarrow as pa

    last = -np.inf
    try:
        for batch in _batches(path):
            columns = {name: _numbers(path, batch, name) for name in batch.schema.names}
            _check_columns(path, columns)
            t = columns["t"]
            if len(t) and not (t[0] > last and (np.diff(t) > 0).all()):
                read(path)  # which says where
            last = float(t[-1]) if len(t) else last
            whole = _block(columns)
            for first in range(0, len(whole), PART):
                yield whole[first : first + PART]
    except (pa.ArrowException, OSError):
        read(path)  # which says what is wrong with it, and where
        raise
    if last == -np.inf:
        raise SessionError(f"{path}: has no rows; record it again")


def _batches(path: Path) -> Iterator[pa.RecordBatch]:
    """Record batches of a file of any kind, with our columns."""
    if path.name.endswith(".arrows"):
        yield from _recorded(path)
    elif path.name.endswith(".parquet"):
        import pyarrow.parquet

        whole = pyarrow.parquet.ParquetFile(
            path, page_checksum_verification=True,
            # what it reads ahead it keeps until the end: all of the file
            pre_buffer=False, buffer_size=READ_AT_ONCE,
        )  # fmt: skip
        if not _agrees(whole.metadata):
            read(path)  # which says so
        names = [n for n in whole.schema_arrow.names if n in COLUMNS]
        yield from whole.iter_batches(batch_size=PART, columns=names)
    else:
        yield from rows_of_text(path)


def _recorded(path: Path) -> Iterator[pa.RecordBatch]:
    """Batches of a stream; behind a damaged place, of all that is whole at once."""
    import pyarrow as pa

    rows = 0
    with pa.OSFile(str(path)) as source:
        batches = in_order(source)
        while True:
            try:
                batch = next(batches)
            except StopIteration as end:
                finished = bool(end.value)
                break
            rows += batch.num_rows
            yield batch
    if not finished or not rows:
        table, _ = _read_arrows(path)
        yield from table.slice(rows).to_batches()


def _table(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    if path.name.endswith(".arrows"):
        return _read_arrows(path)
    if path.name.endswith(".parquet"):
        return _read_parquet(path), ()
    return read_text(path)


def _read_arrows(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    import pyarrow as pa

    data = path.read_bytes()
    found = decode(data, schema())
    if found.schema is None:
        raise SessionError(
            f"{path}: holds no samples: it was cut off before the first were there"
        )
    table = pa.Table.from_batches(found.batches, found.schema)
    return table, tuple(f"{path.name}: {sentence}" for sentence in found.says)


def _read_parquet(path: Path) -> pa.Table:
    import pyarrow as pa
    import pyarrow.parquet

    try:
        # its read_table loads all that reads many files as one, pandas too if installed
        file = pyarrow.parquet.ParquetFile(path, page_checksum_verification=True)
        table = file.read()
        if not _agrees(file.metadata):
            raise pa.ArrowInvalid(
                "what it says of its rows and columns is contradictory"
            )
        # no checksum covers the names: what was changed there may be no text
        return table.select([n for n in table.column_names if n in COLUMNS])
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        if isinstance(error, OSError) and error.errno:
            raise
        raise SessionError(
            f"{path}: is not a whole Parquet file; copy it again from where it came"
        ) from error


def _agrees(about: Any) -> bool:
    """Whether a Parquet file tells its rows and columns apart; no checksum covers that.

    It says everywhere how many rows it has, and no two of its columns have one name.
    """
    names, rows = [n for n in about.schema.names if n in COLUMNS], 0
    if len(set(names)) < len(names):
        return False
    for i in range(about.num_row_groups):
        group = about.row_group(i)
        parts = [group.column(j) for j in range(group.num_columns)]
        many = {p.num_values for p in parts if p.path_in_schema in COLUMNS}
        if not many <= {group.num_rows}:
            return False
        rows += group.num_rows
    return bool(rows == about.num_rows)


def _numbers(path: Path, table: pa.Table | pa.RecordBatch, name: str) -> Array:
    import pyarrow as pa

    column = table.column(name)
    if name not in COLUMNS:
        return np.empty(0)
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise SessionError(f"{path}: column {name} holds {column.type}, not numbers")
    if column.type != pa.float64():  # casting loads all that Arrow computes with
        column = column.cast(pa.float64())
    return numbers(column)


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


def _block(columns: dict[str, Array]) -> Block:
    """Samples of columns, which are used up."""
    unknown = np.full(len(columns["t"]), np.nan)
    triad = {
        kind: np.column_stack([columns.pop(kind + axis, unknown) for axis in "xyz"])
        for kind in "ag"
    }
    rest = [columns.get(n, unknown) for n in ("temperature", "seq", "t_host")]
    return Block(columns["t"], triad["a"], triad["g"], *rest)


def from_table(table: pa.Table) -> Block:
    """Samples of a table with `COLUMNS` that was written here."""
    return _block({n: numbers(table.column(n)) for n in table.column_names})


def schema() -> pa.Schema:
    """Columns of a samples file that is written here."""
    import pyarrow as pa

    return pa.schema([(name, pa.float64()) for name in COLUMNS])


def to_batch(block: Block, *, nulls: bool = False) -> pa.RecordBatch:
    """The samples as an Arrow record batch with all of `COLUMNS`.

    With `nulls`, a column of which nothing is known is null: then it takes no room in
    Parquet. In a stream it would, of bytes that no checksum covers.
    """
    import pyarrow as pa

    columns = [block.t, *block.acc.T, *block.gyr.T]
    columns += [block.temperature, block.t_host, block.seq]
    # pa.array would look for pandas first, and load all of it where it is installed
    arrays = [
        pa.nulls(len(block), pa.float64())
        if nulls and _unknown(c)
        else pa.Array.from_buffers(
            pa.float64(),
            len(block),
            [None, pa.py_buffer(np.ascontiguousarray(c, dtype=float))],
        )
        for c in columns
    ]
    return pa.RecordBatch.from_arrays(arrays, names=list(COLUMNS))


def _unknown(column: Array) -> bool:
    one = column[:1] if not any(column.strides) else column  # one number for all
    return bool(len(column) and np.isnan(column[0]) and np.isnan(one).all())
