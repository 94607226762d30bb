"""Columns of a table that hold lists or structures, made columns of numbers.

accelerometer: list<double>  [0.1, 0.2, 9.8]    accelerometer.0 .1 .2
gyr: struct<x, y, z>                            gyr.x gyr.y gyr.z
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np

LONGEST = 16
"""Numbers of a list that are columns; more are a signal, or an image."""


def flat_name(name: str, names: Sequence[str]) -> str:
    """Name of the column of a file in which a flat one lies.

    >>> flat_name("acc.0", ["t", "acc"]), flat_name("acc.x", ["acc.x", "acc"])
    ('acc', 'acc.x')
    """
    while name not in names and "." in name:
        name = name.rpartition(".")[0]
    return name


def flat_batches(schema: Any, batches: Iterator[Any]) -> tuple[Any, Iterator[Any]]:
    """Schema and batches of Arrow with such columns apart.

    A list has as many columns as it has numbers in the first row; where it has another
    number of them, they are unknown.

    Parameters
    ----------
    schema, batches : as a file has them

    """
    import pyarrow as pa

    if not any(pa.types.is_nested(field.type) for field in schema):
        return schema, batches
    first = next(batches, None)
    if first is None:
        return schema, iter(())
    widths = {
        field.name: _width(first.column(i)) for i, field in enumerate(first.schema)
    }
    flat = (_flat(batch, widths) for batch in chain([first], batches))
    begun = next(flat)
    return begun.schema, chain([begun], flat)


def _width(column: Any) -> int:
    """Numbers of the first list of a column; 0 of other columns."""
    import pyarrow as pa

    kind = column.type
    if not _is_list(kind) or not len(column):
        return 0
    numbers = pa.types.is_floating(kind.value_type) or pa.types.is_integer(
        kind.value_type
    )
    first = column[0].as_py()
    width = len(first) if numbers and first else 0
    return width if width <= LONGEST else 0


def _is_list(kind: Any) -> bool:
    import pyarrow as pa

    return bool(
        pa.types.is_list(kind)
        or pa.types.is_large_list(kind)
        or pa.types.is_fixed_size_list(kind)
    )


def _flat(batch: Any, widths: dict[str, int]) -> Any:
    import pyarrow as pa

    fields, columns = [], []
    for field, column in zip(batch.schema, batch.columns, strict=True):
        if pa.types.is_struct(field.type):
            for sub, part in zip(field.type, column.flatten(), strict=True):
                fields.append(pa.field(f"{field.name}.{sub.name}", sub.type))
                columns.append(part)
        elif width := widths.get(field.name, 0):
            for i, part in enumerate(_parts(column, width)):
                fields.append(pa.field(f"{field.name}.{i}", pa.float64()))
                columns.append(pa.array(part))
        else:
            fields.append(field)
            columns.append(column)
    return pa.RecordBatch.from_arrays(columns, schema=pa.schema(fields))


def _parts(column: Any, width: int) -> Iterator[Any]:
    """Numbers (n,) of each place of lists; nan of lists that have not so many."""
    import pyarrow as pa
    import pyarrow.compute as pc

    lengths = pc.list_value_length(column)
    whole = pc.fill_null(pc.equal(lengths, width), False)
    numbers = column.filter(whole).flatten().cast(pa.float64(), safe=False)
    found = np.full((len(column), width), np.nan)
    known = np.asarray(whole)
    found[known] = numbers.to_numpy(zero_copy_only=False).reshape(-1, width)
    yield from found.T.copy()
