"""Files of raw samples: .arrows (what the tool records), .csv, .csv.gz, .parquet.

A file that was cut off while it was written is read up to the last whole row, and the
cut is reported; what is wrong otherwise (rows out of order, text where a number
belongs, no rows at all) is an error that names the file, the row and the column. Rows
are counted from 1, the row of names not among them.
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.errors import SessionError
from fieldcal.samples import Array, Block

if TYPE_CHECKING:
    import pyarrow as pa

COLUMNS = (
    *("t", "ax", "ay", "az", "gx", "gy", "gz"),
    *("temperature", "t_host", "seq"),
)
"""Every column a samples file can have, in the order they are written."""

ENDINGS = (".arrows", ".parquet", ".csv", ".csv.gz")

_GUNZIP = 16 + zlib.MAX_WBITS


def find(folder: Path, stem: str = "samples") -> Path:
    """The one samples file of a session folder.

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
    """Samples of a file as they stand there, and warnings about what was cut off.

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
    _check_columns(path, columns)
    _check_rows(path, columns)
    return _block(columns), warnings


def _table(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    if path.name.endswith(".arrows"):
        return _read_arrows(path)
    if path.name.endswith(".parquet"):
        return _read_parquet(path), ()
    return _read_csv(path)


def _read_arrows(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    import pyarrow as pa

    batches: list[pa.RecordBatch] = []
    cut = False
    with path.open("rb") as file:
        try:
            reader = pa.ipc.open_stream(file)
        except (pa.ArrowInvalid, EOFError) as error:
            raise SessionError(
                f"{path}: holds no samples: it was cut off before the first were there"
            ) from error
        try:
            for batch in reader:
                batch.validate(full=True)
                batches.append(batch)
        except (pa.ArrowInvalid, OSError):
            cut = True
        table = pa.Table.from_batches(batches, reader.schema)
    # a stream that was closed in order ends with a marker of 8 bytes
    ended = path.read_bytes()[-8:] == b"\xff\xff\xff\xff\0\0\0\0"
    return table, _cut_off(path, table) if cut or not ended else ()


def whole_batches(path: Path) -> tuple[int, int]:
    """Bytes to the end of the last whole batch of an .arrows file; number of batches.

    A stream that was closed in order ends behind that, with a marker.
    """
    import pyarrow as pa

    end, messages = 0, 0
    with pa.OSFile(str(path)) as file:
        try:
            while True:
                pa.ipc.read_message(file)
                end, messages = file.tell(), messages + 1
        except (pa.ArrowInvalid, EOFError, OSError):
            pass
    return end, max(0, messages - 1)


def _read_parquet(path: Path) -> pa.Table:
    import pyarrow as pa
    import pyarrow.parquet

    try:
        return pyarrow.parquet.read_table(path)
    except pa.ArrowInvalid as error:
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


def _numbers(path: Path, table: pa.Table, name: str) -> Array:
    import pyarrow as pa

    column = table.column(name)
    if name not in COLUMNS:
        return np.empty(0)
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise SessionError(f"{path}: column {name} holds {column.type}, not numbers")
    values: Array = column.cast(pa.float64()).to_numpy()
    return values


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
    unknown = np.full(len(columns["t"]), np.nan)
    triad = {
        kind: np.column_stack([columns.get(kind + axis, unknown) for axis in "xyz"])
        for kind in "ag"
    }
    rest = [columns.get(n, unknown) for n in ("temperature", "seq", "t_host")]
    return Block(columns["t"], triad["a"], triad["g"], *rest)


def to_batch(block: Block) -> pa.RecordBatch:
    """The samples as an Arrow record batch with all of `COLUMNS`."""
    import pyarrow as pa

    columns = [block.t, *block.acc.T, *block.gyr.T]
    columns += [block.temperature, block.t_host, block.seq]
    arrays = [pa.array(np.ascontiguousarray(c, dtype=float)) for c in columns]
    return pa.RecordBatch.from_arrays(arrays, names=list(COLUMNS))
