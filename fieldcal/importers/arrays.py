"""Arrays: MATLAB .mat of any version, HDF5, NumPy .npz and .npy.

What is in a file are arrays with names. ``--columns t,ax,ay,az`` names the columns of
the only table in it; ``--columns t=time,ax=acc.0,ay=acc.1`` takes columns of several
arrays, counted from 0. A table lies on its side where it is wider than long.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fieldcal import columns, headings
from fieldcal.errors import InputError
from fieldcal.packed import head, on_disk
from fieldcal.recording import Recording, Stream
from fieldcal.samples import Array, Block

WHAT = "arrays: MATLAB, HDF5, NumPy"

HDF5 = b"\x89HDF\r\n\x1a\n"
MATLAB = b"MATLAB 5.0 MAT-file"
WIDEST = 64
"""Columns of a table that are read together."""

ROWS = 1 << 14
"""Rows read together: few enough to stay in the processor's cache."""

NPZ, NPY = b"PK\x03\x04", b"\x93NUMPY"


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one of them; HDF5 may have 512 bytes before it."""
    return _is_hdf5(head) or head.startswith((MATLAB, NPZ, NPY))


def _is_hdf5(head: bytes) -> bool:
    return head.startswith(HDF5) or head[512:520] == HDF5


class Table(NamedTuple):
    """An array of one or two dimensions.

    Attributes
    ----------
    shape : (rows, columns)
    read : gives some rows of a column
    unit : as an attribute of it says, or nothing

    """

    shape: tuple[int, int]
    read: Callable[[int, slice], Array]
    unit: str = ""


class File(Recording):
    """Arrays with names, with one IMU in them."""

    _loaded: dict[str, Table] | None = None
    """Of a format whose reader gives all arrays at once, so that it does so once."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """h5py, where it is HDF5."""
        return (("h5py",) if _is_hdf5(head(self.path)) else ()), "hdf5"

    def streams(self) -> list[Stream]:
        """Return the one IMU."""
        with self._opened() as tables:
            named = self._named(tables)
        columns.check(replace(self.wanted, columns=tuple(named)))
        return [Stream("0", f"columns in {columns.units(self.wanted)}")]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the units."""
        return columns.notes(self.wanted)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples, some rows at a time."""
        with self._opened() as tables:
            named = self._named(tables)
            samples = columns.Samples(replace(self.wanted, columns=tuple(named)))
            (rows,) = {tables[name].shape[0] for name, _ in named.values()}
            if not rows:
                raise InputError(f"{self.path}: its arrays are empty")
            for first in range(0, rows, ROWS):
                some = slice(first, min(first + ROWS, rows))
                try:
                    got = {
                        column: tables[name].read(i, some)
                        for column, (name, i) in named.items()
                    }
                except (OSError, ValueError, TypeError, RuntimeError) as error:
                    raise InputError(
                        f"{self.path}: rows {first + 1} to {some.stop} cannot be read:"
                        f" {error}; copy it again from where it came"
                    ) from error
                yield samples.block(got, some.stop - first)

    def _named(self, tables: Mapping[str, Table]) -> dict[str, tuple[str, int]]:
        """Array and its column, by column of a session."""
        if not self.wanted.columns:
            self.wanted, says = headings.settle(
                self.path,
                self.wanted,
                headings.read(_columns(tables)),
                f"{self.path}: say which arrays are the channels, such as --columns "
                f"t=time,ax=acc.0,ay=acc.1; there are {_listed(tables)}",
            )
            self.says.append(says)
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
                    f" {_listed(tables)}"
                )
            named[column] = (name, int(index))
        lengths = {tables[name].shape[0] for name, _ in named.values()}
        if len(lengths) > 1:
            raise InputError(
                f"{self.path}: its arrays are of different lengths: {_listed(tables)};"
                " import those that belong together"
            )
        return named

    def _of_one(
        self, tables: Mapping[str, Table], given: tuple[str, ...]
    ) -> dict[str, tuple[str, int]]:
        fitting = [n for n, table in tables.items() if table.shape[1] == len(given)]
        if len(fitting) != 1:
            raise InputError(
                f"{self.path}: {len(fitting)} of its arrays have {len(given)} columns; "
                f"name array and column, as in ax=acc.0; there are {_listed(tables)}"
            )
        pairs = {c: (fitting[0], i) for i, c in enumerate(given)}
        return {c: place for c, place in pairs.items() if c != columns.SKIP}

    @contextmanager
    def _opened(self) -> Iterator[dict[str, Table]]:
        """Every array of numbers in the file."""
        if self._loaded is not None:
            yield self._loaded
            return
        with ExitStack() as stack:
            path = stack.enter_context(on_disk(self.path, self.cut_off))
            with path.open("rb") as file:
                first = file.read(520)
            try:
                if _is_hdf5(first):
                    tables = _hdf5(path, stack)
                else:
                    read = _matlab if first.startswith(MATLAB) else _numpy
                    tables = self._loaded = read(path)
            except InputError:
                raise
            except Exception as error:
                # the readers of the several formats raise what they like
                raise InputError(
                    f"{self.path}: is not whole: {error or type(error).__name__}; copy"
                    " it again from where it came"
                ) from error
            yield tables


def _columns(tables: Mapping[str, Table]) -> list[headings.Column]:
    """Columns of the arrays; those of a table of three are axes."""
    found = []
    for name, table in tables.items():
        bare, many = name.rpartition("/")[2], table.shape[1]
        if many == 1:
            found.append(headings.Column(name, bare, table.unit))
        elif many == len("xyz"):
            found += [
                headings.Column(f"{name}.{i}", f"{bare}_{axis}", table.unit)
                for i, axis in enumerate("xyz")
            ]
    return found


def _listed(tables: Mapping[str, Table]) -> str:
    shapes = [f"{n} {t.shape[0]}x{t.shape[1]}" for n, t in list(tables.items())[:20]]
    return ", ".join(shapes) or "no arrays of numbers"


def _hdf5(path: Path, stack: ExitStack) -> dict[str, Table]:
    import h5py

    file = stack.enter_context(h5py.File(path, "r"))
    found: dict[str, Table] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf":
            table = _table(item.shape, _slabs(item))
            if table and not name.startswith("#"):
                said = item.attrs.get("units", item.attrs.get("unit", ""))
                text = said.decode() if isinstance(said, bytes) else str(said)
                found[name] = table._replace(unit=text)

    file.visititems(visit)
    return found


def _slabs(item: Any) -> Callable[[Any], Array]:
    """Read all columns together, though they are asked for one by one.

    They lie side by side in the file, and are often packed together.
    """
    held: dict[str, Any] = {"rows": None}

    def get(key: Any) -> Array:
        if len(item.shape) == 1 or min(item.shape) > WIDEST:
            return np.asarray(item[key])
        rows = next(part for part in key if isinstance(part, slice))
        if held["rows"] != rows:
            whole = tuple(rows if part == rows else slice(None) for part in key)
            held.update(rows=rows, slab=np.asarray(item[whole]))
        found: Array = held["slab"][
            tuple(slice(None) if part == rows else part for part in key)
        ]
        return found

    return get


def _matlab(path: Path) -> dict[str, Table]:
    from scipy.io import loadmat

    return _of_arrays(loadmat(path))


def _numpy(path: Path) -> dict[str, Table]:
    loaded = np.load(path, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return _of_arrays({"array": loaded})
    with loaded:
        return _of_arrays({name: loaded[name] for name in loaded.files})


def _of_arrays(arrays: Mapping[str, Any]) -> dict[str, Table]:
    found = {}
    for name, array in arrays.items():
        if isinstance(array, np.ndarray) and array.dtype.kind in "iuf":
            table = _table(array.shape, array.__getitem__)
            if table:
                found[name] = table
    return found


def _table(shape: tuple[int, ...], get: Callable[[Any], Array]) -> Table | None:
    """Rows and columns of an array; None if it has no such."""
    if len(shape) == 1:
        return Table((shape[0], 1), lambda i, rows: np.asarray(get(rows), dtype=float))
    if len(shape) != 2:
        return None
    if shape[0] >= shape[1]:
        return Table(
            (shape[0], shape[1]),
            lambda i, rows: np.asarray(get((rows, i)), dtype=float),
        )
    return Table(
        (shape[1], shape[0]), lambda i, rows: np.asarray(get((i, rows)), dtype=float)
    )
