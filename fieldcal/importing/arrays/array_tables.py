"""Arrays of a file as tables: MATLAB up to version 7, HDF5, NumPy.

A table lies on its side where it is wider than long. Fields of structures and of arrays
of records are arrays too, with the name of both: ``imu/acc``.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.importing.arrays.matlab_objects import DECODE
from fieldcal.importing.headings.heading import Column
from fieldcal.importing.words.heading_words import heading_meaning

WIDEST = 64
"""Columns of a table that are read together: they lie side by side in the file."""

GROWS = 0.99
"""Share of steps of a column that are not backwards, if it is the time."""

ROWS = 1 << 14
"""Rows read together: few enough to stay in the processor's cache."""

DIMENSIONS = (1, 2)

MAX_UNPACKED_BYTES, MAX_COMPRESSION = 1 << 28, 50
"""Bytes that an archive may always unpack to, and how many times its size beyond that:
noise does not compress."""


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


def columns_of(tables: Mapping[str, ArrayTable]) -> list[Column]:
    """Columns of the arrays; those of a table of three are axes."""
    found = []
    for name, table in tables.items():
        bare, many = _table_label(name), table.shape[1]
        if many == 1:
            found.append(Column(name, bare, table.unit))
        elif many <= WIDEST:
            names = _names(bare, many, table)
            found += [
                Column(f"{name}.{i}", one, "" if one == "t" else table.unit)
                for i, one in enumerate(names)
            ]
    return found


def _table_label(name: str) -> str:
    """Label of an array, with the name of its group if that adds a sensor: acc/data."""
    within, _, bare = name.rpartition("/")
    group = within.rpartition("/")[2]
    with_group = f"{group}_{bare}"
    known = [
        heading_meaning(one) or heading_meaning(f"{one}_x")
        for one in (bare, with_group)
    ]
    return with_group if group and known[0] is None and known[1] else bare


def _names(bare: str, many: int, table: ArrayTable) -> list[str]:
    """Names of a table's columns: three are axes, and before them may be the time."""
    three = [f"{bare}_{axis}" for axis in "xyz"]
    behind = {2: [bare], 1 + len(three): three}.get(many)
    if behind is not None:
        (first,) = table.read(slice(0, min(table.shape[0], ROWS)), [0])
        if len(first) > 1 and (np.diff(first) >= 0).mean() > GROWS:
            return ["t", *behind]
    return three if many == len(three) else [f"{bare}_{i}" for i in range(many)]


def describe_tables(tables: Mapping[str, ArrayTable]) -> str:
    """Names and shapes of tables, for messages."""
    shapes = [f"{n} {t.shape[0]}x{t.shape[1]}" for n, t in list(tables.items())[:20]]
    return ", ".join(shapes) or "no arrays of numbers"


def matlab_arrays(path: Path) -> dict[str, Any]:
    """What a MATLAB file up to version 7 holds, structures as mappings."""
    from scipy.io import loadmat

    loaded: dict[str, Any] = loadmat(path, simplify_cells=True)
    # where objects are kept is no array of the user's
    loaded.pop("__function_workspace__", None)
    return loaded


def numpy_tables(path: Path) -> dict[str, ArrayTable]:
    """Arrays of a .npy or .npz file."""
    if zipfile.is_zipfile(path):
        _check_size(path)
    loaded = np.load(path, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return tables_of({"array": loaded})
    with loaded:
        return tables_of({name: loaded[name] for name in loaded.files})


def _check_size(path: Path) -> None:
    """Refuse an archive that unpacks to far more than any recording does."""
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
    packed = sum(m.compress_size for m in members)
    size = sum(m.file_size for m in members)
    if size > MAX_UNPACKED_BYTES and size > MAX_COMPRESSION * packed:
        raise InputError(
            f"{path}: unpacks from {packed / 1e6:.1f} MB to {size / 1e9:.1f} GB, as no"
            " recording of a sensor does; save it again with numpy.savez"
        )


def tables_of(arrays: Mapping[str, Any]) -> dict[str, ArrayTable]:
    """Arrays of numbers as tables, also those within structures."""
    return {
        name: table_of(array)
        for name, array in _flat_arrays(arrays)
        if array.dtype.kind in "iuf" and array.ndim in DIMENSIONS
    }


def _flat_arrays(arrays: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Arrays and their names, also those within structures and arrays of records."""
    for name, value in arrays.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}/{inner}", one) for inner, one in _flat_arrays(value))
        elif isinstance(value, np.ndarray):
            for field in _fields(value.dtype):
                yield name + field, value[field[1:]] if field else value


def hdf5_tables(file: Any, units: Mapping[str, str]) -> dict[str, ArrayTable]:
    """Arrays of an HDF5 file whose names and units are known."""
    return {name: table_of(_dataset(file, name), unit) for name, unit in units.items()}


def hdf5_has_objects(file: Any) -> bool:
    """Whether an HDF5 file of MATLAB holds objects, such as tables."""
    return any(DECODE in item.attrs for name, item in file.items() if name[0] != "#")


def hdf5_units(file: Any) -> dict[str, str]:
    """Arrays of numbers in an HDF5 file and their units, where it says them."""
    import h5py

    found = {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        if DECODE in item.attrs:
            return
        attributes = {name.lower(): value for name, value in item.attrs.items()}
        said = attributes.get("units", attributes.get("unit", ""))
        unit = said.decode() if isinstance(said, bytes) else str(said)
        for field, kind in _fields(item.dtype).items():
            if kind.base.kind in "iuf" and item.ndim + len(kind.shape) in DIMENSIONS:
                found[f"{name}{field}"] = unit

    file.visititems(visit)
    return found


def _fields(kind: np.dtype[Any]) -> dict[str, np.dtype[Any]]:
    """Types of the fields of an array of records, by "/" and name; "" of others."""
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
