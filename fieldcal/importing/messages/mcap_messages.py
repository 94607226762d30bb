"""Messages of an MCAP file one after the other, also where its summary is missing.

A file that was cut off has no summary, which says where everything is; its records are
whole all the same up to the cut. A chunk has a checksum of its own: one that is damaged
costs no other. Source: MCAP format specification, mcap.dev.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fieldcal.core.errors import InputError
from fieldcal.importing.files.packed_stream import OnTruncation

if TYPE_CHECKING:
    from mcap.records import Channel, Message, Schema


class DecodedMessage(NamedTuple):
    """A message with what it is."""

    kind: str
    schema: Schema | None
    channel: Channel
    message: Message


class _Dictionary:
    """Schemas and channels so far."""

    def __init__(self) -> None:
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}

    def take(self, record: Any) -> DecodedMessage | None:
        """Take note of a record, or say what message it is."""
        from mcap.records import Channel, Message, Schema

        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Message) and record.channel_id in self._channels:
            channel = self._channels[record.channel_id]
            schema = self._schemas.get(channel.schema_id)
            return DecodedMessage(
                schema.name if schema else "", schema, channel, record
            )
        return None


def messages(
    path: Path, damaged: OnTruncation, cut: OnTruncation
) -> Iterator[DecodedMessage]:
    """Messages in the order of the file.

    Parameters
    ----------
    path : not packed
    damaged : called with a damaged chunk, which is left out
    cut : called with the place where the file ends too early

    """
    known, seen = _Dictionary(), 0
    try:
        for record in _records(path, damaged):
            said = known.take(record)
            if said:
                seen += 1
                yield said
    except InputError:
        raise
    except Exception as error:
        # a file that ends anywhere makes its reader raise what it likes
        cut(f"behind message {seen}", f"is cut off ({error or type(error).__name__})")


def _records(path: Path, damaged: OnTruncation) -> Iterator[Any]:
    from mcap.records import Chunk, DataEnd
    from mcap.stream_reader import StreamReader, breakup_chunk

    chunks = 0
    with path.open("rb") as file:
        # a length that is damaged must not take all memory
        most = path.stat().st_size
        reader = StreamReader(file, emit_chunks=True, record_size_limit=most)
        for record in reader.records:
            if isinstance(record, DataEnd):
                return
            if not isinstance(record, Chunk):
                yield record
                continue
            chunks += 1
            try:
                inner = breakup_chunk(record, validate_crc=True)
            except Exception as error:
                # so do those that unpack
                damaged(f"chunk {chunks}", f"cannot be read ({error})")
                continue
            yield from inner


Decoder = Callable[[bytes], Any]


class QuietDecoders:
    """What makes decoders of ROS 2 messages, for a reader of `mcap`.

    The library prints a definition that it cannot read, and raises an error that says
    the same; a reader needs the error.
    """

    def __init__(self) -> None:
        from mcap_ros2.decoder import DecoderFactory

        self._factory = DecoderFactory()

    def decoder_for(self, encoding: str, schema: Schema | None) -> Decoder | None:
        """What decodes messages of a schema; None of those that nobody here knows."""
        with redirect_stderr(StringIO()):
            made: Decoder | None = self._factory.decoder_for(encoding, schema)
        return made


class Decoders:
    """Reads the contents of messages, each by its schema."""

    def __init__(self) -> None:
        self._factory = QuietDecoders()
        self._known: dict[int, Decoder | None] = {}

    def read(self, said: DecodedMessage) -> Any:
        """What is in a message; None if it is of no kind that can be read."""
        number = said.channel.id
        if number not in self._known:
            encoding = said.channel.message_encoding
            self._known[number] = self._factory.decoder_for(encoding, said.schema)
        decoder = self._known[number]
        return decoder(said.message.data) if decoder else None
