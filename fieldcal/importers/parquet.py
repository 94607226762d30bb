"""Parquet and Arrow files: columns by their names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.importing import columns, headings
from fieldcal.importing.gzip_stream import on_disk
from fieldcal.importing.recording import ROWS, ImuStream, Recording
from fieldcal.session.arrow_stream import numbers

WHAT = "Parquet and Arrow"

PARQUET, FEATHER, STREAM = b"PAR1", b"ARROW1", b"\xff\xff\xff\xff"


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one of them."""
    return head.startswith((PARQUET, FEATHER, STREAM))


class ParquetFile(Recording):
    """A table with named columns, with one IMU in it."""

    asks_units = True

    def streams(self) -> list[ImuStream]:
        """Return the one IMU."""
        with self._batches() as (schema, _):
            self._named(schema)
        return [ImuStream("0", f"columns in {columns.units(self.wanted)}")]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the units."""
        return columns.notes(self.wanted)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples, a batch at a time."""
        samples = columns.ColumnReader(self.wanted)
        with self._batches() as (schema, batches):
            named = self._named(schema)
            for batch in batches:
                batch.validate(full=True)
                table = {c: self._numbers(batch, n) for c, n in named.items()}
                yield samples.block(table, batch.num_rows)

    @contextmanager
    def _batches(self) -> Iterator[tuple[Any, Iterator[Any]]]:
        """Schema of its columns, and its batches."""
        import pyarrow as pa
        import pyarrow.parquet

        with on_disk(self.path, self.cut_off) as path, path.open("rb") as file:
            magic = file.read(6)
            file.seek(0)
            try:
                if magic.startswith(PARQUET):
                    opened = pyarrow.parquet.ParquetFile(file)
                    schema = opened.schema_arrow
                    wanted = [n for n in self._named(schema).values()]
                    one = {"columns": wanted, "use_threads": False}
                    yield schema, opened.iter_batches(ROWS, **one)
                elif magic == FEATHER:
                    feather = pa.ipc.open_file(file)
                    many = range(feather.num_record_batches)
                    yield feather.schema, (feather.get_batch(i) for i in many)
                else:
                    stream = pa.ipc.open_stream(file)
                    yield stream.schema, iter(stream)
            except (pa.ArrowException, OSError) as error:
                raise InputError(
                    f"{self.path}: is not whole: {error}; copy it again from where it"
                    " came"
                ) from error

    def _named(self, schema: Any) -> dict[str, str]:
        """Names in the file by column."""
        names = schema.names
        ask = (
            f"say which are the channels with --columns t=…,ax=…: there are"
            f" {', '.join(names[:30])}"
        )
        if not self.wanted.columns:
            said = [headings.Column(f.name, f.name, _unit(f)) for f in schema]
            found = headings.read(said)
            self.wanted, says = headings.resolve_headings(
                self.path, self.wanted, found, f"{self.path}: {ask}"
            )
            self.says.append(says)
        pairs = [c.partition("=") for c in self.wanted.columns]
        named = {column: name or column for column, _, name in pairs}
        missing = [name for name in named.values() if name not in names]
        if missing:
            raise InputError(f"{self.path}: has no column {missing[0]}; {ask}")
        columns.check(replace(self.wanted, columns=tuple(named)))
        return named

    def _numbers(self, batch: Any, name: str) -> Array:
        import pyarrow as pa

        column = batch.column(name)
        kind = column.type
        if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            column = column.cast(pa.int64())
        elif not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            raise InputError(
                f"{self.path}: column {name} holds {kind}, not numbers; name another"
                " with --columns"
            )
        return numbers(column.cast(pa.float64(), safe=False))


def _unit(field: Any) -> str:
    """What a column says of its unit."""
    said = field.metadata or {}
    text: bytes = said.get(b"unit", said.get(b"units", b""))
    return text.decode(errors="replace")
