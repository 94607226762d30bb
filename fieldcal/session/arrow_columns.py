"""Arrow columns as numpy arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.samples import Array

if TYPE_CHECKING:
    import pyarrow as pa


def float_values(column: pa.Array | pa.ChunkedArray) -> Array:
    """Values of a column of float64; nan where null.

    Arrow's own conversion imports pandas where it is installed, which takes long.
    """
    chunks = getattr(column, "chunks", [column])
    parts = [_numbers(chunk) for chunk in chunks if len(chunk)]
    return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0), *parts])


def _numbers(chunk: pa.Array) -> Array:
    there, values = chunk.buffers()
    first, last = chunk.offset, chunk.offset + len(chunk)
    out = np.frombuffer(values, dtype=float)[first:last]
    if not chunk.null_count:
        return out
    bits = np.unpackbits(np.frombuffer(there, dtype=np.uint8), bitorder="little")
    return np.where(bits[first:last], out, np.nan)
