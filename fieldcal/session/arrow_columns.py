"""Columns of Arrow as arrays of numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fieldcal.core.samples import Array

if TYPE_CHECKING:
    import pyarrow as pa


def numbers(column: pa.Array | pa.ChunkedArray) -> Array:
    """Values of a column of float64; nan where there is none.

    Arrow's own way would load all of pandas, where it is installed, to see whether what
    it is asked for is one of pandas' kinds.
    """
    chunks = getattr(column, "chunks", [column])
    parts = [_numbers(chunk) for chunk in chunks if len(chunk)]
    return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0), *parts])


def _numbers(chunk: pa.Array) -> Array:
    whole = chunk.fill_null(np.nan) if chunk.null_count else chunk
    first, last = whole.offset, whole.offset + len(whole)
    return np.frombuffer(whole.buffers()[1], dtype=float)[first:last]
