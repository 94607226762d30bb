"""Samples as text: comma-separated columns under a row of names, packed by gzip or not.

A file that was cut off is read up to its last whole row. Errors name the row and the
column.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.core.errors import SessionError

if TYPE_CHECKING:
    import pyarrow as pa

SAMPLE_COLUMNS = (
    *("t", "ax", "ay", "az", "gx", "gy", "gz"),
    *("temperature", "t_host", "seq"),
)
"""Columns that a samples file may have, in the order in which they are written."""

_NAMES_BYTES = 1 << 16
"""Bytes at the beginning within which the names of the columns end."""

_GUNZIP = 16 + zlib.MAX_WBITS


def iterate_text_batches(path: Path) -> Iterator[pa.RecordBatch]:
    """Record batches of a text file, decompressed while it is read."""
    import pyarrow as pa
    import pyarrow.csv

    packed = "gzip" if path.name.endswith(".gz") else None
    with pa.input_stream(path, compression=packed) as stream:
        names = _names(path, stream.read(_NAMES_BYTES))
    with pa.input_stream(path, compression=packed) as stream:
        reader = pyarrow.csv.open_csv(
            stream,
            read_options=pyarrow.csv.ReadOptions(
                use_threads=False, block_size=1 << 24, skip_rows=1, column_names=names
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={name: pa.float64() for name in SAMPLE_COLUMNS},
                null_values=["", "nan", "NaN"],
            ),
        )
        for batch in reader:
            yield batch.select([n for n in batch.schema.names if n in SAMPLE_COLUMNS])


def read_text_table(path: Path) -> tuple[pa.Table, tuple[str, ...]]:
    """Table of a whole text file, and warnings about what was cut off.

    Raises
    ------
    SessionError
        If it is not such a file; names row and column.

    """
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
    names = _names(path, data)
    try:
        table = pyarrow.csv.read_csv(
            pa.BufferReader(data),
            read_options=pyarrow.csv.ReadOptions(
                use_threads=False, skip_rows=1, column_names=names
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={name: pa.float64() for name in SAMPLE_COLUMNS},
                include_columns=[n for n in names if n in SAMPLE_COLUMNS],
                null_values=["", "nan", "NaN"],
            ),
        )
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise SessionError(f"{path}: {_first_bad_row(names, data)}") from error
    return table, cut_off_warnings(path, table) if cut or short else ()


def _names(path: Path, data: bytes) -> list[str]:
    """Names of the columns, without spaces and quotes about them.

    Raises
    ------
    SessionError
        If they are not those of samples, or a column is there twice.

    """
    # Excel begins "CSV UTF-8" with a byte order mark
    first = data.split(b"\n", 1)[0].decode("utf-8-sig", errors="replace")
    names = [name.strip().strip('"') for name in first.split(",")]
    known = [name for name in names if name in SAMPLE_COLUMNS]
    if not known:
        raise SessionError(
            f"{path}: the first row must name the columns: {', '.join(SAMPLE_COLUMNS)}"
        )
    for name in known:
        if known.count(name) > 1:
            raise SessionError(f"{path}: has two columns {name}; name one otherwise")
    return names


def _gunzip(path: Path, data: bytes) -> tuple[bytes, bool]:
    """Decompressed data as far as possible, and whether the end is missing."""
    unpack = zlib.decompressobj(_GUNZIP)
    try:
        out = unpack.decompress(data)
    except zlib.error as error:
        raise SessionError(
            f"{path}: is no gzip file, or damaged ({error}); copy it again from where"
            " it came"
        ) from error
    while unpack.eof and unpack.unused_data.strip(b"\0"):
        data, unpack = unpack.unused_data, zlib.decompressobj(_GUNZIP)
        out += unpack.decompress(data)
    return out, not unpack.eof


def _without_short_row(data: bytes) -> tuple[bytes, bool]:
    """Data without an incomplete last row, and whether there was one."""
    if data.endswith(b"\n"):
        return data, False
    head, _, last = data.rpartition(b"\n")
    wanted = data.split(b"\n", 1)[0].count(b",")
    if not head or last.count(b",") >= wanted:
        return data, False
    return head + b"\n", True


def _first_bad_row(names: Sequence[str], data: bytes) -> str:
    """Text about the first invalid row; slow, used after a failure only."""
    lines = data.decode(errors="replace").splitlines()
    for row, line in enumerate(lines[1:], start=1):
        if "\0" in line:
            return (
                f"row {row} holds {line.count(chr(0))} zero bytes, as after a power"
                " cut: copy the file again from where it came, or remove that row"
            )
        cells = line.split(",")
        if line and len(cells) != len(names):
            return (
                f"row {row} has {len(cells)} columns, not {len(names)}; mend that row"
            )
        for name, cell in zip(names, cells, strict=False):
            if name in SAMPLE_COLUMNS and not _is_number(cell):
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


def cut_off_warnings(path: Path, table: pa.Table) -> tuple[str, ...]:
    """Warnings about a file that was cut off."""
    return (f"{path.name} was cut off; its {table.num_rows} whole rows are used",)
