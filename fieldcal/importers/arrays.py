"""Arrays: MATLAB .mat of any version, HDF5, NumPy .npz and .npy.

What is in a file are arrays with names. ``--columns t,ax,ay,az`` names the columns of
the only table in it; ``--columns t=time,ax=acc.0,ay=acc.1`` takes columns of several
arrays, counted from 0. A table lies on its side where it is wider than long. Fields of
structures and of arrays of records are arrays too, with the name of both: ``imu/acc``.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.importing import columns
from fieldcal.importing.column_recording import ColumnRecording, Heading
from fieldcal.importing.gzip_stream import head, on_disk
from fieldcal.importing.headings import Column

WHAT = "arrays: MATLAB, HDF5, NumPy"

HDF5 = b"\x89HDF\r\n\x1a\n"
MATLAB = b"MATLAB 5.0 MAT-file"
WIDEST = 64
"""Columns of a table that are read together: they lie side by side in the file."""

BEGINNING = 1 << 16
"""Rows at the beginning by which physics tells columns."""

GROWS = 0.99
"""Share of steps of a column that are not backwards, if it is the time."""

ROWS = 1 << 14
"""Rows read together: few enough to stay in the processor's cache."""

DIMENSIONS = (1, 2)

LARGE, DENSEST = 1 << 28, 50
"""Bytes that an archive may always unpack to, and how many times its size beyond that:
noise is not to be compressed."""

NPZ, NPY = b"PK\x03\x04", b"\x93NUMPY"


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one of them; HDF5 may have 512 bytes before it."""
    arrays = head.startswith(NPZ) and b".npy" in head
    return arrays or _is_hdf5(head) or head.startswith((MATLAB, NPY))


def _is_hdf5(head: bytes) -> bool:
    return head.startswith(HDF5) or head[512:520] == HDF5


class ArrayTable(NamedTuple):
    """An array of one or two dimensions.

    Attributes
    ----------
    shape : (rows, columns)
    read : gives some rows (n,) of each of some columns
    unit : as an attribute of it says, or nothing

    """

    shape: tuple[int, int]
    read: Callable[[slice, Sequence[int]], list[Array]]
    unit: str = ""


class ArrayFile(ColumnRecording):
    """Arrays with names, with one IMU in them or several."""

    _loaded: dict[str, ArrayTable] | None = None
    """Of a format whose reader gives all arrays at once, so that it does so once."""
    _units: dict[str, str] | None = None
    """Of the arrays of an HDF5 file, so that it is looked through once."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """h5py, where it is HDF5."""
        return (("h5py",) if _is_hdf5(head(self.path)) else ()), "hdf5"

    def heading(self) -> list[Heading]:
        """Names of the columns of its arrays."""
        with self._opened() as tables:
            return [Heading(_columns(tables))]

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

    def ask(self) -> str:
        """Say which arrays there are."""
        with self._opened() as tables:
            return (
                f"{self.path}: say which arrays are the channels, such as --columns "
                f"t=time,ax=acc.0,ay=acc.1; there are {_listed(tables)}"
            )

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples, some rows at a time."""
        if len(self.imus()) > 1:
            yield from self.alone(stream).blocks(stream)
            return
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
        self, tables: Mapping[str, ArrayTable], given: tuple[str, ...]
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
    def _opened(self) -> Iterator[dict[str, ArrayTable]]:
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
                    tables = self._hdf5(path, stack)
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

    def _hdf5(self, path: Path, stack: ExitStack) -> dict[str, ArrayTable]:
        import h5py

        file = stack.enter_context(h5py.File(path, "r"))
        if self._units is None:
            self._units = _units(file)
        return {
            name: table_of(_dataset(file, name), unit)
            for name, unit in self._units.items()
        }


def _columns(tables: Mapping[str, ArrayTable]) -> list[Column]:
    """Columns of the arrays; those of a table of three are axes."""
    found = []
    for name, table in tables.items():
        bare, many = name.rpartition("/")[2], table.shape[1]
        if many == 1:
            found.append(Column(name, bare, table.unit))
        elif many <= WIDEST:
            names = _names(bare, many, table)
            found += [
                Column(f"{name}.{i}", one, "" if one == "t" else table.unit)
                for i, one in enumerate(names)
            ]
    return found


def _names(bare: str, many: int, table: ArrayTable) -> list[str]:
    """Names of a table's columns: three are axes, and before them may be the time."""
    three = [f"{bare}_{axis}" for axis in "xyz"]
    behind = {2: [bare], 1 + len(three): three}.get(many)
    if behind is not None:
        (first,) = table.read(slice(0, min(table.shape[0], ROWS)), [0])
        if len(first) > 1 and (np.diff(first) >= 0).mean() > GROWS:
            return ["t", *behind]
    return three if many == len(three) else [f"{bare}_{i}" for i in range(many)]


def _listed(tables: Mapping[str, ArrayTable]) -> str:
    shapes = [f"{n} {t.shape[0]}x{t.shape[1]}" for n, t in list(tables.items())[:20]]
    return ", ".join(shapes) or "no arrays of numbers"


def _units(file: Any) -> dict[str, str]:
    """Arrays of numbers in an HDF5 file and their units, where it says them."""
    import h5py

    found = {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        said = item.attrs.get("units", item.attrs.get("unit", ""))
        unit = said.decode() if isinstance(said, bytes) else str(said)
        for field, kind in _fields(item.dtype).items():
            if kind.base.kind in "iuf" and item.ndim + len(kind.shape) in DIMENSIONS:
                found[f"{name}{field}"] = unit

    file.visititems(visit)
    return found


def _matlab(path: Path) -> dict[str, ArrayTable]:
    from scipy.io import loadmat

    return _of_arrays(loadmat(path, simplify_cells=True))


def _numpy(path: Path) -> dict[str, ArrayTable]:
    if zipfile.is_zipfile(path):
        _check_size(path)
    loaded = np.load(path, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return _of_arrays({"array": loaded})
    with loaded:
        return _of_arrays({name: loaded[name] for name in loaded.files})


def _check_size(path: Path) -> None:
    """Refuse an archive that unpacks to far more than any recording does."""
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
    packed = sum(m.compress_size for m in members)
    size = sum(m.file_size for m in members)
    if size > LARGE and size > DENSEST * packed:
        raise InputError(
            f"{path}: unpacks from {packed / 1e6:.1f} MB to {size / 1e9:.1f} GB, as no"
            " recording of a sensor does; save it again with numpy.savez"
        )


def _of_arrays(arrays: Mapping[str, Any]) -> dict[str, ArrayTable]:
    return {
        name: table_of(array)
        for name, array in _leaves(arrays)
        if array.dtype.kind in "iuf" and array.ndim in DIMENSIONS
    }


def _leaves(arrays: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Arrays and their names, also those within structures and arrays of records."""
    for name, value in arrays.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}/{inner}", one) for inner, one in _leaves(value))
        elif isinstance(value, np.ndarray):
            for field in _fields(value.dtype):
                yield name + field, value[field[1:]] if field else value


def _fields(kind: np.dtype[Any]) -> dict[str, np.dtype[Any]]:
    """Kinds of what an array of records holds, by "/" and its name; "" of others."""
    if kind.names is None:
        return {"": kind}
    return {f"/{name}": kind[name] for name in kind.names}


def _dataset(file: Any, name: str) -> Any:
    """A dataset of an HDF5 file, or a field of one."""
    if name in file:
        return file[name]
    whole, _, field = name.rpartition("/")
    return _Field(file[whole], field)


class _Field:
    """A field of a dataset of records, read as if it were an array of its own."""

    def __init__(self, dataset: Any, name: str) -> None:
        self._dataset, self._name = dataset, name
        self.shape = dataset.shape + dataset.dtype[name].shape
        self.ndim = len(self.shape)

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, rows: Any) -> Any:
        first = rows[0] if isinstance(rows, tuple) else rows
        read = self._dataset.fields(self._name)[first]
        return read[:, rows[1]] if isinstance(rows, tuple) else read


def table_of(array: Any, unit: str = "") -> ArrayTable:
    """Rows and columns of an array of one or two dimensions, in memory or in a file."""
    if array.ndim == 1:
        return ArrayTable((len(array), 1), lambda rows, _: [_floats(array[rows])], unit)
    long, wide = max(array.shape), min(array.shape)
    lies = array.shape[0] < long

    def read(rows: slice, some: Sequence[int]) -> list[Array]:
        if wide > WIDEST:
            return [_floats(array[(i, rows) if lies else (rows, i)]) for i in some]
        slab = array[:, rows] if lies else array[rows].T
        return [_floats(slab[i]) for i in some]

    return ArrayTable((long, wide), read, unit)


def _floats(values: Any) -> Array:
    return np.asarray(values, dtype=float)
