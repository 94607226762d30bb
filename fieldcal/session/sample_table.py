"""Samples as a table of columns, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.session.arrow_columns import float_values
from fieldcal.session.text_files import SAMPLE_COLUMNS

if TYPE_CHECKING:
    import pyarrow as pa


def block_from_columns(columns: dict[str, Array]) -> Block:
    """Samples from columns, each in one piece in memory; `columns` is emptied."""
    unknown = np.full(len(columns["t"]), np.nan)
    triad = {
        kind: np.stack([columns.pop(kind + axis, unknown) for axis in "xyz"]).T
        for kind in "ag"
    }
    t, *rest = (
        _owned(columns.pop(n, unknown)) for n in ("t", "temperature", "seq", "t_host")
    )
    return Block(t, triad["a"], triad["g"], *rest)


def _owned(column: Array) -> Array:
    """The column by itself: a part of a file would keep all of it in memory."""
    return column if column.flags.owndata else column.copy()


def block_from_table(table: pa.Table) -> Block:
    """Samples of a table with `SAMPLE_COLUMNS` that was written here."""
    return block_from_columns(
        {n: float_values(table.column(n)) for n in table.column_names}
    )


def samples_schema() -> pa.Schema:
    """Columns of a samples file that is written here."""
    import pyarrow as pa

    return pa.schema([(name, pa.float64()) for name in SAMPLE_COLUMNS])


def to_record_batch(block: Block, *, nulls: bool = False) -> pa.RecordBatch:
    """The samples as an Arrow record batch with all of `SAMPLE_COLUMNS`.

    With `nulls`, a column without any value is null, and takes no space in Parquet. In
    a stream it would still take space, which no checksum covers.
    """
    import pyarrow as pa

    columns = [block.t, *block.acc.T, *block.gyr.T]
    columns += [block.temperature, block.t_host, block.seq]
    # pa.array imports pandas where it is installed, which takes long
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
    return pa.RecordBatch.from_arrays(arrays, names=list(SAMPLE_COLUMNS))


def _unknown(column: Array) -> bool:
    one = column[:1] if not any(column.strides) else column  # one number for all
    return bool(len(column) and np.isnan(column[0]) and np.isnan(one).all())
