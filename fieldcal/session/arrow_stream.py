"""Reads samples from an Arrow IPC stream in which every batch has its own checksum.

`arrow_encoder` writes it. Intact batches are read. A batch that was cut off, changed,
lost or doubled is reported. After a damaged place, reading continues with the next
intact batch.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from fieldcal.session.arrow_encoder import batch_checksum

if TYPE_CHECKING:
    import pyarrow as pa

MARKER = b"\xff\xff\xff\xff"
"""First bytes of every message of a stream; messages begin at multiples of 8 bytes."""

BATCH_KEYS = {"crc32", "number", "row"}
"""Metadata of each batch; a stream of another program has none of these."""

CLOSING_BYTES = MARKER + b"\0\0\0\0"
"""Last bytes of a stream that was closed."""


class StreamContent(NamedTuple):
    """Content of a stream.

    Attributes
    ----------
    schema : its columns; None if these cannot be read
    batches : intact batches, in order
    faults : one sentence for each fault, without the file's name
    checked : whether every batch had a checksum
    number, row : number and first row of the batch that would follow

    """

    schema: pa.Schema | None
    batches: list[pa.RecordBatch]
    faults: list[str]
    checked: bool
    number: int
    row: int


def batches_before_damage(source: Any) -> Generator[pa.RecordBatch, None, bool]:
    """Batches of a stream, one at a time, up to the first that is damaged.

    Parameters
    ----------
    source : the file, as Arrow opens it

    Returns
    -------
    True if the whole stream was read. Use `decode_stream` to read on after damage.

    """
    import pyarrow as pa

    number = row = 0
    try:
        stream = pa.ipc.open_stream(source)
        while True:
            batch, said = _next_batch(stream)
            if BATCH_KEYS & said.keys():
                stated = int(said["number"]), int(said["row"]), int(said["crc32"], 16)
                if stated != (number, row, batch_checksum(batch, number, row)):
                    return False
            yield batch
            number, row = number + 1, row + batch.num_rows
    except StopIteration:
        return True
    except (pa.ArrowException, OSError, EOFError, ValueError, KeyError):
        return False


def end_of_whole_batches(data: bytes) -> int:
    """Number of bytes up to the end of the last whole batch; 0 if there is none.

    A closed stream has a marker after that.
    """
    import pyarrow as pa

    source, end, batches = pa.BufferReader(data), 0, 0
    try:
        while True:
            batches += pa.ipc.read_message(source).type == "record batch"
            end = int(source.tell())
    except (pa.ArrowException, EOFError, OSError):
        return end if batches else 0


def decode_stream(data: bytes, usual: pa.Schema | None = None) -> StreamContent:
    """Read the intact batches of a stream.

    Parameters
    ----------
    data : the file
    usual : columns to assume where the header of the stream is damaged

    """
    return _Decoder(data, usual).run()


class _Decoder:
    """Reads a stream message by message."""

    def __init__(self, data: bytes, usual: pa.Schema | None) -> None:
        import pyarrow as pa

        self._data = pa.py_buffer(data)
        self._raw = data
        self._read_errors = (pa.ArrowException, OSError, EOFError, ValueError, KeyError,
                        StopIteration)  # fmt: skip
        self._usual = usual
        self._head = b""
        self._schema: pa.Schema | None = None
        self._source = pa.BufferReader(self._data)
        self._stream: Any = None
        self._next = -1
        self._batches: list[Any] = []
        self._faults_found: list[str] = []
        self._expected, self._row, self._checked = 0, 0, True

    def run(self) -> StreamContent:
        at = self._read_head()
        if self._schema is not None:
            self._read_all(at)
        if not self._checked:
            self._expected = len(self._batches)
            self._row = sum(batch.num_rows for batch in self._batches)
        return StreamContent(
            self._schema,
            self._batches,
            self._faults_found,
            self._checked,
            self._expected,
            self._row,
        )

    def _read_head(self) -> int:
        """Where the first batch begins."""
        import pyarrow as pa

        try:
            self._stream = pa.ipc.open_stream(self._source)
            self._schema = self._stream.schema
            self._next = end = int(self._source.tell())
            self._head = self._raw[:end]
            return end
        except self._read_errors:
            if self._usual is None or not self._raw:
                return 0
        with pa.BufferOutputStream() as sink, pa.ipc.new_stream(sink, self._usual):
            pass
        head = sink.getvalue().to_pybytes()[: -len(CLOSING_BYTES)]
        first = next(self._candidates(8), None)
        if first is None:
            return 0
        self._faults_found.append("its head is damaged; the usual columns are taken")
        self._schema, self._head = self._usual, head
        return first

    def _read_all(self, at: int) -> None:
        size = len(self._raw)
        while at < size:
            if self._raw[at : at + len(CLOSING_BYTES)] == CLOSING_BYTES:
                at += len(CLOSING_BYTES)
                if at < size:
                    self._faults_found.append(
                        f"{size - at} bytes behind its end are left out"
                    )
                return
            end = self._message(at)
            if end is None:
                behind = next(
                    (c for c in self._candidates(at + 8) if self._whole(c)), None
                )
                if behind is None:
                    break
                self._faults_found.append(
                    f"bytes {at} to {behind} are damaged and left out"
                )
                end = behind
            at = end
        rows = sum(batch.num_rows for batch in self._batches)
        self._faults_found.append(f"was cut off; its {rows} whole rows are used")

    def _whole(self, at: int) -> bool:
        """Whether a message that can be read begins at byte `at`."""
        return self._read(at) is not None

    def _candidates(self, at: int) -> Iterator[int]:
        at = self._raw.find(MARKER, at)
        while at >= 0:
            if at % 8 == 0:
                yield at
            at = self._raw.find(MARKER, at + 1)

    def _read(self, at: int) -> tuple[int, Any, dict[str, str]] | None:
        """End of a message, its batch and metadata; None if it cannot be read."""
        import pyarrow as pa

        try:
            if at == self._next:  # after the previous message: its bytes need no copy
                found = _next_batch(self._stream)
                self._next = int(self._source.tell())
                return self._next, *found
        except self._read_errors:
            self._next = -1
        source = pa.BufferReader(self._data.slice(at))
        try:
            message = pa.ipc.read_message(source)
            end = at + int(source.tell())
            if message.type != "record batch":
                return end, None, {}
            return end, *_next_batch(pa.ipc.open_stream(self._head + self._raw[at:end]))
        except self._read_errors:
            return None

    def _message(self, at: int) -> int | None:
        """Take the message at byte `at`; returns its end, None if it cannot be read."""
        found = self._read(at)
        if found is None:
            return None
        end, batch, said = found
        if batch is not None:
            self._take(batch, said)
        return end

    def _take(self, batch: Any, said: dict[str, str]) -> None:
        if not BATCH_KEYS & said.keys() and not self._expected:
            self._checked = False
            self._batches.append(batch)
            return
        try:
            number, row = int(said["number"]), int(said["row"])
            good = int(said["crc32"], 16) == batch_checksum(batch, number, row)
        except (KeyError, ValueError):
            good, number, row = False, self._expected, self._row
        if not good:
            self._faults_found.append(
                f"batch {self._expected + 1}, {batch.num_rows} rows from row "
                f"{self._row + 1} on, is damaged and left out"
            )
            self._expected, self._row = self._expected + 1, self._row + batch.num_rows
            return
        if number and number < self._expected:
            self._faults_found.append(
                f"batch {number + 1} is there twice; once is used"
            )
            return
        if number > self._expected:
            self._faults_found.append(
                f"batches {self._expected + 1} to {number} are missing, rows "
                f"{self._row + 1} to {row}"
            )
        self._expected, self._row = number + 1, row + batch.num_rows
        self._batches.append(batch)


def _next_batch(stream: Any) -> tuple[Any, dict[str, str]]:
    """Next batch of a stream, and its metadata."""
    batch, said = stream.read_next_batch_with_custom_metadata()
    batch.validate(full=True)
    # Arrow takes metadata that are no text
    pairs = (said or {}).items()
    return batch, {
        k.decode(errors="replace"): v.decode(errors="replace") for k, v in pairs
    }
