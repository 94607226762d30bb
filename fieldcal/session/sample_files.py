"""Files of raw samples: .arrows (what the tool records), .csv, .csv.gz, .parquet.

A file that was cut off while it was written is read up to the last whole row, and the
cut is reported; what is wrong otherwise (rows out of order, text where a number
belongs, no rows at all) is an error that names the file, the row and the column. Rows
are counted from 1, the row of names not among them.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.errors import SessionError
from fieldcal.core.samples import Array, Block
from fieldcal.session.arrow_stream import decode, in_order, numbers

if TYPE_CHECKING:
    import pyarrow as pa

COLUMNS = (
    *("t", "ax", "ay", "az", "gx", "gy", "gz"),
    *("temperature", "t_host", "seq"),
)
"""Every column a samples file can have, in the order they are written."""

ENDINGS = (".arrows", ".parquet", ".csv", ".csv.gz")

PART = 1 << 17
"""Rows that are handed over together, at most."""

_GUNZIP = 16 + zlib.MAX_WBITS


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

        whole = pyarrow.parquet.ParquetFile(path, page_checksum_verification=True)
        names = [n for n in whole.schema_arrow.names if n in COLUMNS]
        yield from whole.iter_batches(batch_size=PART, columns=names)
    else:
        yield from _rows_of_text(path)


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


def _rows_of_text(path: Path) -> Iterator[pa.RecordBatch]:
    """Record batches of a text, unpacked as it is read."""
    import pyarrow as pa
    import pyarrow.csv

    packed = path.name.endswith(".gz")
    with pa.input_stream(path, compression="gzip" if packed else None) as stream:
        reader = pyarrow.csv.open_csv(
            stream,
            read_options=pyarrow.csv.ReadOptions(use_threads=False, block_size=1 << 24),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={name: pa.float64() for name in COLUMNS},
                null_values=["", "nan", "NaN"],
            ),
        )
        for batch in reader:
            yield batch.select([n for n in batch.schema.names if n in COLUMNS])


def _table(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    if path.name.endswith(".arrows"):
        return _read_arrows(path)
    if path.name.endswith(".parquet"):
        return _read_parquet(path), ()
    return _read_csv(path)


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
        table = pyarrow.parquet.read_table(path, page_checksum_verification=True)
        # no checksum covers the names: what was changed there may be no text
        return table.select([n for n in table.column_names if n in COLUMNS])
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        if isinstance(error, OSError) and error.errno:
            raise
        raise SessionError(
            f"{path}: is not a whole Parquet file; copy it again from where it came"
        ) from error


def _read_csv(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    import pyarrow as pa
    import pyarrow.csv

    data, cut = path.read_bytes(), False
    if path.name.endswith(".gz"):
        data, cut = _gunzip(path, data)
    if cut:
        data = data[: data.rfind(b"\n") + 1]
    if not data.strip():
        raise SessionError(f"{path}: is empty; it needs a row of names and samples")
    data, short = _without_short_row(data)
    names = _names(data)
    if not set(names) & set(COLUMNS):
        raise SessionError(
            f"{path}: the first row must name the columns: {', '.join(COLUMNS)}"
        )
    try:
        table = pyarrow.csv.read_csv(
            pa.BufferReader(data),
            read_options=pyarrow.csv.ReadOptions(
                use_threads=False, skip_rows=1, column_names=names
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={name: pa.float64() for name in COLUMNS},
                include_columns=[n for n in names if n in COLUMNS],
                null_values=["", "nan", "NaN"],
            ),
        )
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise SessionError(f"{path}: {_place(data)}") from error
    return table, _cut_off(path, table) if cut or short else ()


def _names(data: bytes) -> list[str]:
    first = data.split(b"\n", 1)[0].decode(errors="replace")
    return [name.strip().strip('"') for name in first.split(",")]


def _gunzip(path: Path, data: bytes) -> tuple[bytes, bool]:
    """What can be unpacked, and whether the end is missing."""
    unpack = zlib.decompressobj(_GUNZIP)
    try:
        out = unpack.decompress(data)
    except zlib.error as error:
        raise SessionError(
            f"{path}: is not a gzip file ({error}); copy it again from where it came"
        ) from error
    while unpack.eof and unpack.unused_data.strip(b"\0"):
        data, unpack = unpack.unused_data, zlib.decompressobj(_GUNZIP)
        out += unpack.decompress(data)
    return out, not unpack.eof


def _without_short_row(data: bytes) -> tuple[bytes, bool]:
    """Leave out a last row that was cut off in the middle."""
    if data.endswith(b"\n"):
        return data, False
    head, _, last = data.rpartition(b"\n")
    wanted = data.split(b"\n", 1)[0].count(b",")
    if not head or last.count(b",") >= wanted:
        return data, False
    return head + b"\n", True


def _place(data: bytes) -> str:
    """Say where the first row that is none stands: the slow way, after a failure."""
    lines = data.decode(errors="replace").splitlines()
    names = _names(data)
    for row, line in enumerate(lines[1:], start=1):
        cells = line.split(",")
        if line and len(cells) != len(names):
            return (
                f"row {row} has {len(cells)} columns, not {len(names)}; mend that row"
            )
        for name, cell in zip(names, cells, strict=False):
            if name in COLUMNS and not _is_number(cell):
                return (
                    f"row {row}, column {name}: {cell.strip()[:20]!r} is not a number;"
                    " mend it, or leave it empty where the value is missing"
                )
    return "is not a csv file with comma-separated columns"


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _cut_off(path: Path, table: pa.Table) -> tuple[str, ...]:
    return (f"{path.name} was cut off; its {table.num_rows} whole rows are used",)


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
