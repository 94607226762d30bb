"""Writes samples as an Arrow IPC stream in which each batch carries its own checksum.

Any Arrow reader opens the file. The metadata of each batch hold ``crc32`` of its
columns, one after the other, its ``number`` and its first ``row``.
"""

from __future__ import annotations

import io
import zlib
from typing import TYPE_CHECKING

import numpy as np

from fieldcal.session.arrow_columns import float_values

if TYPE_CHECKING:
    import pyarrow as pa


class ArrowEncoder:
    """Encodes a stream, one batch at a time.

    Parameters
    ----------
    schema : columns of every batch
    number, row : batches and rows that exist already, where a stream is continued

    """

    def __init__(self, schema: pa.Schema, number: int = 0, row: int = 0) -> None:
        import pyarrow as pa

        self._sink = io.BytesIO()
        self._stream = pa.ipc.new_stream(self._sink, schema)
        self._number, self._row = number, row
        self._there = schema.serialize().to_pybytes() if number else b""

    def encode(self, batch: pa.RecordBatch) -> bytes:
        """Bytes of the next batch; the first ones include the stream's header."""
        said = {
            "crc32": f"{batch_checksum(batch, self._number, self._row):08x}",
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


def batch_checksum(batch: pa.RecordBatch, number: int, row: int) -> int:
    """Checksum of a batch's values, its number and its first row."""
    crc = zlib.crc32(b"%d %d" % (number, row))
    for name, column in zip(batch.schema.names, batch.columns, strict=True):
        known = column.type == "double"
        values = (
            float_values(column) if known else column.to_numpy(zero_copy_only=False)
        )
        values = np.ascontiguousarray(values)
        crc = zlib.crc32(values.data, zlib.crc32(name.encode(), crc))
    return crc
