"""Writes samples as an Arrow IPC stream in which each batch carries its own checksum.

Any Arrow reader opens the file; the checksum stands in the batch's own metadata:
``crc32`` of its columns, one after the other, and its ``number`` and first ``row``.
"""

from __future__ import annotations

import io
import zlib
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.session.arrow_columns import numbers

if TYPE_CHECKING:
    import pyarrow as pa


class ArrowEncoder:
    """Makes the bytes of a stream, a batch at a time.

    Parameters
    ----------
    schema : columns of every batch
    number, row : batches and rows that are there already, in a stream that goes on

    """

    def __init__(self, schema: pa.Schema, number: int = 0, row: int = 0) -> None:
        import pyarrow as pa

        self._sink = io.BytesIO()
        self._stream = pa.ipc.new_stream(self._sink, schema)
        self._number, self._row = number, row
        self._there = schema.serialize().to_pybytes() if number else b""

    def batch(self, batch: pa.RecordBatch) -> bytes:
        """Bytes of the next batch, with those of the stream's head before the first."""
        said = {
            "crc32": f"{checksum(batch, self._number, self._row):08x}",
            "number": str(self._number),
            "row": str(self._row),
        }
        self._stream.write_batch(batch, custom_metadata=said)
        self._number += 1
        self._row += batch.num_rows
        return self._taken()

    def end(self) -> bytes:
        """Bytes that end the stream."""
        self._stream.close()
        return self._taken()

    def _taken(self) -> bytes:
        data = self._sink.getvalue().removeprefix(self._there)
        self._there = b""
        self._sink.seek(0)
        self._sink.truncate()
        return data


def checksum(batch: pa.RecordBatch, number: int, row: int) -> int:
    """Checksum of a batch's numbers and of its place."""
    crc = zlib.crc32(b"%d %d" % (number, row))
    for name, column in zip(batch.schema.names, batch.columns, strict=True):
        known = column.type == "double"
        values = numbers(column) if known else column.to_numpy(zero_copy_only=False)
        values = np.ascontiguousarray(values)
        crc = zlib.crc32(values.data, zlib.crc32(name.encode(), crc))
    return crc
