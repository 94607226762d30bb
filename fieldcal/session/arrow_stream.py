"""Reads samples from an Arrow IPC stream in which every batch has its own checksum.

`arrow_encoder` writes it. Intact batches are read. A batch that was cut off, changed,
lost or doubled is reported. After a damaged place, reading continues with the next
intact batch.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from fieldcal.session.arrow_encoder import batch_checksum
from fieldcal.session.stream_damage import (
    MARKER,
    StreamDamage,
    cut_off,
    lost_at_end,
    lost_between,
)

if TYPE_CHECKING:
    import pyarrow as pa

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
    end : byte behind the last whole batch, intact or not; 0 if there is none
    breaks : number of intact rows in front of each damaged place between two of them

    """

    schema: pa.Schema | None
    batches: list[pa.RecordBatch]
    faults: list[str]
    checked: bool
    number: int
    row: int
    end: int
    breaks: tuple[int, ...]


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
        self._end, self._rows = 0, 0
        self._breaks: list[int] = []
        self._damage: StreamDamage | None = None

    def run(self) -> StreamContent:
        at = self._read_head()
        if self._schema is not None:
            self._read_all(at)
        number, row = self._expected, self._row
        if not self._checked:
            number, row = len(self._batches), self._rows
        elif self._damage is not None:
            number, row = number + self._damage.batches, row + self._damage.rows
        return StreamContent(
            self._schema,
            self._batches,
            self._faults_found,
            self._checked,
            number,
            row,
            self._end,
            tuple(self._breaks),
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
                self._close(at + len(CLOSING_BYTES))
                return
            end = self._message(at)
            if end is None:
                end = next(
                    (c for c in self._candidates(at + 8) if self._whole(c)), None
                )
                if end is None:
                    break
                self._note_damage(at, end)
            at = end
        self._faults_found.append(cut_off(self._rows, self._last))

    @property
    def _last(self) -> Any:
        """The last intact batch so far; None before the first."""
        return self._batches[-1] if self._batches else None

    def _close(self, end: int) -> None:
        """Say what is wrong at the end of a stream that was closed."""
        if self._damage is not None:
            self._faults_found.append(lost_at_end(self._row + 1, self._last))
        if end < len(self._raw):
            self._faults_found.append(
                f"{len(self._raw) - end} bytes behind its end are left out"
            )

    def _note_damage(self, at: int, end: int, batches: int = 0, rows: int = 0) -> None:
        """Remember that the bytes from `at` to `end` cannot be used."""
        place = self._damage or StreamDamage(at, at)
        self._damage = place.extended(end, batches, rows)

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
            self._take(batch, said, at, end)
            self._end = end
        return end

    def _take(self, batch: Any, said: dict[str, str], at: int, end: int) -> None:
        if not BATCH_KEYS & said.keys() and not self._expected:
            self._checked = False
            self._keep(batch, "")
            return
        try:
            number, row = int(said["number"]), int(said["row"])
            good = int(said["crc32"], 16) == batch_checksum(batch, number, row)
        except (KeyError, ValueError):
            good, number, row = False, self._expected, self._row
        if not good:
            self._note_damage(at, end, 1, batch.num_rows)
            return
        if number and number < self._expected:
            self._faults_found.append(
                f"batch {number + 1} is there twice; once is used"
            )
            return
        lost = f"rows {self._row + 1} to {row}" if number > self._expected else ""
        self._keep(batch, lost)
        self._expected, self._row = number + 1, row + batch.num_rows

    def _keep(self, batch: Any, lost: str) -> None:
        """Use an intact batch; `lost` are the rows that are missing in front of it."""
        place = self._damage
        if not lost and place is not None:
            lost = f"bytes {place.first} to {place.end}"
        if lost:
            self._faults_found.append(lost_between(lost, self._last, batch))
            if self._rows:
                self._breaks.append(self._rows)
        self._damage = None
        self._batches.append(batch)
        self._rows += batch.num_rows


def _next_batch(stream: Any) -> tuple[Any, dict[str, str]]:
    """Next batch of a stream, and its metadata."""
    batch, said = stream.read_next_batch_with_custom_metadata()
    batch.validate(full=True)
    # Arrow takes metadata that are no text
    pairs = (said or {}).items()
    return batch, {
        k.decode(errors="replace"): v.decode(errors="replace") for k, v in pairs
    }
