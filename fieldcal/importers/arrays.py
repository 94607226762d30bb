"""Arrays: MATLAB .mat of any version, HDF5, NumPy .npz and .npy.

What is in a file are arrays with names. ``--columns t,ax,ay,az`` names the columns of
the only table in it; ``--columns t=time,ax=acc.0,ay=acc.1`` takes columns of several
arrays, counted from 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Self

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.importing import columns
from fieldcal.importing.arrays.array_groups import arrays_in_group, imu_groups
from fieldcal.importing.arrays.array_tables import (
    ROWS,
    WIDEST,
    ArrayTable,
    columns_of,
    describe_tables,
    hdf5_has_objects,
    hdf5_tables,
    hdf5_units,
    matlab_arrays,
    numpy_tables,
    tables_of,
)
from fieldcal.importing.arrays.device_rows import device_rows
from fieldcal.importing.arrays.matlab_objects import holds_objects, object_tables
from fieldcal.importing.arrays.paired_tables import ArrayPairing, pair_arrays
from fieldcal.importing.files.packed_stream import first_bytes, unpacked_file
from fieldcal.importing.headings.heading import Heading
from fieldcal.importing.tables.divided_recording import DividedRecording
from fieldcal.importing.times.said_rate import named_scalars, stated_rate

WHAT = "arrays: MATLAB, HDF5, NumPy"

HDF5 = b"\x89HDF\r\n\x1a\n"
MATLAB = b"MATLAB 5.0 MAT-file"

BEGINNING = 1 << 16
"""Rows at the beginning by which physics tells columns."""

NPZ, NPY = b"PK\x03\x04", b"\x93NUMPY"


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one of them; HDF5 may have 512 bytes before it."""
    arrays = head.startswith(NPZ) and b".npy" in head
    return arrays or _is_hdf5(head) or head.startswith((MATLAB, NPY))


def _is_hdf5(head: bytes) -> bool:
    return head.startswith(HDF5) or head[512:520] == HDF5


class ArrayFile(DividedRecording):
    """Arrays with names, with one IMU in them or several."""

    _loaded: dict[str, ArrayTable] | None = None
    """Of a format whose reader gives all arrays at once, so that it does so once."""
    _scalars: Mapping[str, float] = {}
    """Numbers that stand alone in it, by name."""
    _objects: Mapping[str, ArrayTable] = {}
    """Tables of MATLAB in an HDF5 file, which another reader gives."""
    _pairing: tuple[ArrayPairing | None] | None = None
    """How its arrays go together, so that it is found once."""
    _units: dict[str, str] | None = None
    """Of the arrays of an HDF5 file, so that it is looked through once."""
    group = ""
    """The only group that is read, where each of several holds an IMU."""
    device = ""
    """The only device that is read, where a column tells the rows of several apart."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """h5py, where it is HDF5."""
        return (("h5py",) if _is_hdf5(first_bytes(self.path)) else ()), "hdf5"

    def _in_parts(self) -> dict[str, Self]:
        """The file with one group or device alone, where there are several."""
        if self.parts_found is None:
            self.parts_found = {}
            with self._arrays() as tables:
                groups = {} if self.wanted.columns or self.group else imu_groups(tables)
                devices = {} if groups or self.device else device_rows(tables).of
            self.parts_found |= {
                n: self._part(group=group) for n, group in groups.items()
            }
            self.parts_found |= {name: self._part(device=name) for name in devices}
        return self.parts_found

    def _part(self, group: str = "", device: str = "") -> Self:
        """The file with one group or one device alone."""
        one = copy(self)
        one.says, one.mended, one.guessed, one.parts_found = [], [], {}, None
        one.group, one.device = group or self.group, device
        return one

    def heading(self) -> list[Heading]:
        """Names of the columns of its arrays."""
        with self._opened() as tables:
            return [Heading(self.named_by_file(columns_of(tables)))]

    def beginning(self) -> Array:
        """First rows of the columns of its longest arrays; of others nothing."""
        with self._opened() as tables:
            longest = max((t.shape[0] for t in tables.values()), default=0)
            rows = slice(0, min(longest, BEGINNING))
            found: list[Array] = []
            for table in tables.values():
                many = range(table.shape[1] if table.shape[1] <= WIDEST else 0)
                whole = table.shape[0] == longest
                nothing = np.full(rows.stop, np.nan)
                found += table.read(rows, many) if whole else [nothing for _ in many]
            return np.reshape(found, (len(found), rows.stop)).T

    def rate_said(self) -> tuple[float, str] | None:
        """Rate that a number in it says, such as ``fs``."""
        with self._opened():
            return stated_rate(self._scalars)

    def ask(self) -> str:
        """Say which arrays there are."""
        with self._opened() as tables:
            return (
                f"{self.path}: say which arrays are the channels, such as --columns "
                f"t=time,ax=acc.0,ay=acc.1; there are {describe_tables(tables)}"
            )

    def read_samples(self) -> Iterator[Block]:
        """Samples, some rows at a time."""
        with self._opened() as tables:
            named = self._named(tables)
            samples = columns.ColumnReader(replace(self.wanted, columns=tuple(named)))
            (rows,) = {tables[name].shape[0] for name, _ in named.values()}
            if not rows:
                raise InputError(f"{self.path}: its arrays are empty")
            wanted: dict[str, dict[str, int]] = {}
            for column, (name, i) in named.items():
                wanted.setdefault(name, {})[column] = i
            for first in range(0, rows, ROWS):
                some = slice(first, min(first + ROWS, rows))
                got: dict[str, Array] = {}
                try:
                    for name, its in wanted.items():
                        read = tables[name].read(some, [*its.values()])
                        got |= zip(its, read, strict=True)
                except (OSError, ValueError, TypeError, RuntimeError) as error:
                    raise InputError(
                        f"{self.path}: rows {first + 1} to {some.stop} cannot be read:"
                        f" {error}; copy it again from where it came"
                    ) from error
                yield samples.block(got, some.stop - first)
            self.says += [s for s in samples.says if s not in self.says]

    def _named(self, tables: Mapping[str, ArrayTable]) -> dict[str, tuple[str, int]]:
        """Array and its column, by column of a session."""
        given = self.wanted.columns
        if not any("=" in column for column in given):
            return self._of_one(tables, given)
        named = {}
        for text in given:
            column, _, place = text.partition("=")
            name, dot, index = place.rpartition(".")
            if not (dot and index.isdecimal() and name in tables):
                name, index = place, "0"
            if name not in tables or int(index) >= tables[name].shape[1]:
                raise InputError(
                    f"{self.path}: has no column {place!r} for {column}; there are"
                    f" {describe_tables(tables)}"
                )
            named[column] = (name, int(index))
        lengths = {tables[name].shape[0] for name, _ in named.values()}
        if len(lengths) > 1:
            raise InputError(
                f"{self.path}: its arrays are of different lengths:"
                f" {describe_tables(tables)};"
                " import those that belong together"
            )
        return named

    def _of_one(
        self, tables: Mapping[str, ArrayTable], given: tuple[str, ...]
    ) -> dict[str, tuple[str, int]]:
        fitting = [n for n, table in tables.items() if table.shape[1] == len(given)]
        if len(fitting) != 1:
            raise InputError(
                f"{self.path}: {len(fitting)} of its arrays have {len(given)} columns; "
                f"name array and column, as in ax=acc.0; there are"
                f" {describe_tables(tables)}"
            )
        pairs = {c: (fitting[0], i) for i, c in enumerate(given)}
        return {c: place for c, place in pairs.items() if c != columns.SKIP}

    @contextmanager
    def _opened(self) -> Iterator[dict[str, ArrayTable]]:
        """Every array of numbers in the file, those of one IMU side by side."""
        with self._arrays() as tables:
            if self._pairing is None:
                with self.named_errors():
                    self._pairing = (pair_arrays(tables),)
            (paired,) = self._pairing
            if paired is None:
                yield tables
                return
            self.says += [said for said in paired.says if said not in self.says]
            yield paired.of(tables)

    @contextmanager
    def _arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Every array of numbers in the file, with the rows of one device."""
        with self._whole_arrays() as tables:
            one = self.device
            yield device_rows(tables).alone(one, tables) if one else tables

    @contextmanager
    def _whole_arrays(self) -> Iterator[dict[str, ArrayTable]]:
        """Every array of numbers in the file, as it lies there."""
        if self._loaded is not None:
            yield arrays_in_group(self.group, self._loaded)
            return
        with ExitStack() as stack:
            path = stack.enter_context(unpacked_file(self.path, self.cut_off))
            with path.open("rb") as file:
                first = file.read(520)
            try:
                if _is_hdf5(first):
                    tables = self._hdf5(path, stack)
                elif first.startswith(MATLAB):
                    loaded = matlab_arrays(path)
                    self._scalars = dict(named_scalars(loaded))
                    if holds_objects(loaded):
                        loaded |= object_tables(path)
                    tables = self._loaded = tables_of(loaded)
                else:
                    tables = self._loaded = numpy_tables(path)
            except InputError:
                raise
            except Exception as error:
                # the readers of the several formats raise what they like
                raise InputError(
                    f"{self.path}: is not whole: {error or type(error).__name__}; copy"
                    " it again from where it came"
                ) from error
            yield arrays_in_group(self.group, tables)

    def _hdf5(self, path: Path, stack: ExitStack) -> dict[str, ArrayTable]:
        import h5py

        file = stack.enter_context(h5py.File(path, "r"))
        if self._units is None:
            self._units = hdf5_units(file)
            if hdf5_has_objects(file):
                self._objects = tables_of(object_tables(path))
        return hdf5_tables(file, arrays_in_group(self.group, self._units)) | dict(
            self._objects
        )
