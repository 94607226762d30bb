"""Parquet and Arrow files: columns by their names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.importing import columns
from fieldcal.importing.arrays.arrow_fields import (
    as_texts,
    column_of,
    holds_times,
    is_text,
    may_name_devices,
)
from fieldcal.importing.arrays.nested_arrow import flat_batches, flat_name
from fieldcal.importing.files.packed_stream import unpacked_file
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.recording import ROWS
from fieldcal.importing.tables.divided_recording import DividedRecording
from fieldcal.importing.text.instances import MAX_NAMED, MIN_ROWS
from fieldcal.importing.times.clock_text import ClockText, is_clock
from fieldcal.importing.times.name_changes import NameChanges
from fieldcal.importing.words.device_names import (
    tells_devices,
    tells_wearers,
)
from fieldcal.session.arrow_columns import float_values
from fieldcal.session.sample_files import BYTES_AT_ONCE

WHAT = "Parquet and Arrow"

TICKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds in one of what stored times count."""

PARQUET, FEATHER, STREAM = b"PAR1", b"ARROW1", b"\xff\xff\xff\xff"


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one of them."""
    return head.startswith((PARQUET, FEATHER, STREAM))


class ParquetFile(DividedRecording):
    """A table with named columns, with one IMU in it or several.

    Attributes
    ----------
    device : column and text of its cells in the rows that are read, where a column
        tells the rows of several devices apart

    """

    device: tuple[str, str] | None = None

    def _in_parts(self) -> dict[str, Self]:
        """The file with the rows of one device alone, where there are several."""
        if self.parts_found is None:
            self.parts_found = {}
            if self.device is None:
                self.parts_found = {
                    n: self._part(at) for n, at in self._devices().items()
                }
        return self.parts_found

    def _part(self, device: tuple[str, str]) -> Self:
        one = copy(self)
        one.says, one.mended, one.guessed, one.parts_found = [], [], {}, None
        one.device = device
        return one

    def _devices(self) -> dict[str, tuple[str, str]]:
        """Column and text by which the rows of each device are told."""
        with self._batches() as (schema, _):
            named = [
                field.name
                for tells in (tells_devices, tells_wearers)
                for field in schema
                if tells(field.name) and may_name_devices(field)
            ]
            times = [one.name for one in schema if holds_times(one)][:1]
        for name in named:
            many: Counter[str] = Counter()
            changes, clock = NameChanges(), ClockText()
            with self._batches(only=(name, *times)) as (_, batches):
                for batch in batches:
                    texts = as_texts(batch.column(name)).to_pylist()
                    many.update(texts)
                    t = self._values(batch.column(times[0]), clock) if times else None
                    if t is not None:
                        changes.feed(np.array(texts), t)
            known = {n: rows for n, rows in many.items() if n is not None}
            if 1 < len(known) <= MAX_NAMED and not changes.go_on:
                return {n: (name, n) for n, rows in known.items() if rows >= MIN_ROWS}
        return {}

    def heading(self) -> list[Heading]:
        """Names of its columns, with their units."""
        with self._batches() as (schema, _):
            return [Heading(self.named_by_file([column_of(f) for f in schema]))]

    def beginning(self) -> Array:
        """Numbers of its first batch; columns of other things are unknown."""
        with self._batches(every=True) as (schema, batches):
            first = next(batches, None)
            if first is None:
                return np.empty((0, len(schema)))
            found = np.full((first.num_rows, len(schema)), np.nan)
            for i, name in enumerate(schema.names):
                values = self._values(first.column(name), ClockText())
                if values is not None:
                    found[:, i] = values
            return found

    def ask(self) -> str:
        """Say which columns there are."""
        with self._batches() as (schema, _):
            names = schema.names
        return (
            f"{self.path}: say which are the channels with --columns t=…,ax=…: there"
            f" are {', '.join(names[:30])}"
        )

    def read_samples(self) -> Iterator[Block]:
        """Samples, a batch at a time."""
        samples, clock = columns.ColumnReader(self.wanted), ClockText()
        with self._batches() as (schema, batches):
            named = self._named(schema)
            for batch in batches:
                batch.validate(full=True)
                table = {c: self._numbers(batch, n, clock) for c, n in named.items()}
                yield samples.block(table, batch.num_rows)
        self.says += [s for s in samples.says if s not in self.says]

    @contextmanager
    def _batches(
        self, every: bool = False, only: Sequence[str] = ()
    ) -> Iterator[tuple[Any, Iterator[Any]]]:
        """Schema of its columns, and its batches, with the rows of one device.

        Of `every` column, of some `only`, or of those wanted.
        """
        with self._whole_batches(every, only) as (schema, batches):
            yield schema, map(self._rows_of_device, batches) if self.device else batches

    def _rows_of_device(self, batch: Any) -> Any:
        """Rows of the only device that is read."""
        import pyarrow.compute as pc

        if self.device is None:
            return batch
        name, device = self.device
        return batch.filter(pc.equal(as_texts(batch.column(name)), device))

    @contextmanager
    def _whole_batches(
        self, every: bool, only: Sequence[str]
    ) -> Iterator[tuple[Any, Iterator[Any]]]:
        """Schema of its columns, and its batches, with the rows of all devices."""
        import pyarrow as pa
        import pyarrow.parquet

        with unpacked_file(self.path, self.cut_off) as path, path.open("rb") as file:
            magic = file.read(6)
            file.seek(0)
            try:
                if magic.startswith(PARQUET):
                    opened = pyarrow.parquet.ParquetFile(
                        # what it reads ahead it keeps until the end: all of the file
                        file, pre_buffer=False, buffer_size=BYTES_AT_ONCE,
                    )  # fmt: skip
                    schema = opened.schema_arrow
                    one: dict[str, Any] = {"use_threads": False}
                    if only:
                        one["columns"] = [*only]
                    elif self.wanted.columns and not every:
                        one["columns"] = self._needed(schema.names)
                    yield flat_batches(schema, opened.iter_batches(ROWS, **one))
                elif magic == FEATHER:
                    feather = pa.ipc.open_file(file)
                    many = range(feather.num_record_batches)
                    each = (feather.get_batch(i) for i in many)
                    yield flat_batches(feather.schema, _gathered(each))
                else:
                    stream = pa.ipc.open_stream(file)
                    yield flat_batches(stream.schema, _gathered(stream))
            except MemoryError as error:  # also of a damaged size
                raise InputError(
                    f"{self.path}: needs more memory than there is, or is damaged; copy"
                    " it again, or shorten the recording"
                ) from error
            except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
                raise InputError(
                    f"{self.path}: is not whole: {error}; copy it again from where it"
                    " came"
                ) from error

    def _needed(self, names: Sequence[str]) -> list[str]:
        """Columns of the file in which those wanted lie; all if one is not there."""
        pairs = [c.partition("=") for c in self.wanted.columns]
        there = {flat_name(name or column, names): None for column, _, name in pairs}
        there |= {self.device[0]: None} if self.device else {}
        return [*there] if there.keys() <= {*names} else [*names]

    def _named(self, schema: Any) -> dict[str, str]:
        """Names in the file by column."""
        pairs = [c.partition("=") for c in self.wanted.columns]
        named = {column: name or column for column, _, name in pairs}
        missing = [name for name in named.values() if name not in schema.names]
        if missing:
            raise InputError(
                f"{self.path}: has no column {missing[0]}; say which are the channels"
                f" with --columns t=…,ax=…: there are {', '.join(schema.names[:30])}"
            )
        columns.check_columns(replace(self.wanted, columns=tuple(named)))
        return named

    def _numbers(self, batch: Any, name: str, clock: ClockText) -> Array:
        found = self._values(batch.column(name), clock)
        if found is None:
            raise InputError(
                f"{self.path}: column {name} holds {batch.column(name).type}, not"
                " numbers; name another with --columns"
            )
        return found

    def _values(self, column: Any, clock: ClockText) -> Array | None:
        """Numbers of a column; None of other things.

        Times that are stored as such know their unit, and texts may be times.
        """
        import pyarrow as pa

        kind = column.type
        if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            ticks = float_values(column.cast(pa.int64()).cast(pa.float64(), safe=False))
            return ticks * TICKS[kind.unit] / self.wanted.time_scale
        if pa.types.is_floating(kind) or pa.types.is_integer(kind):
            return float_values(column.cast(pa.float64(), safe=False))
        if not is_text(kind) or not len(column) or not is_clock(str(column[0])):
            return None
        read = (clock.seconds(str(text)) for text in column)
        found = np.array([np.nan if since is None else since for since in read])
        return found / self.wanted.time_scale


def _gathered(batches: Iterable[Any]) -> Iterator[Any]:
    """Batches of many rows: whoever writes them while they come, writes few in each."""
    import pyarrow as pa

    waiting: list[Any] = []
    for batch in batches:
        waiting.append(batch)
        if sum(one.num_rows for one in waiting) >= ROWS:
            yield from pa.Table.from_batches(waiting).combine_chunks().to_batches()
            waiting = []
    if waiting:
        yield from pa.Table.from_batches(waiting).combine_chunks().to_batches()
