"""CAN frames as rows of fixed size, so that many are processed at once.

Live buses and logs give the same rows. `frame_row` makes one, and
``np.frombuffer(data, FRAME)`` reads any number of them.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

LONGEST_FRAME = 64
"""Bytes of the longest frame, CAN FD."""

FRAME_DTYPE = np.dtype(
    {
        "names": ["t", "id", "size", "bus", "data"],
        "formats": ["<f8", "<u4", "u1", "<u2", ("u1", LONGEST_FRAME)],
        "offsets": [0, 8, 12, 14, 16],
        "itemsize": 16 + LONGEST_FRAME,
    }
)
"""Time stamp of the bus, s; identifier; bytes that came; number of the bus in a log of
several; the bytes, then zeros."""

EXTENDED_FLAG = 1 << 31
"""Added to an identifier of 29 bits."""

ERROR_FLAG = 1 << 29
"""Identifier of an error frame."""

Frames = NDArray[np.void]

_ROW = struct.Struct(f"<dIBxH{LONGEST_FRAME}s")


def frame_row(t: float, identifier: int, extended: bool, data: bytes) -> bytes:
    """One frame as a row.

    >>> row = frame_row(1.5, 0x123, False, bytes([7, 8]))
    >>> np.frombuffer(row, FRAME_DTYPE)["size"].tolist()
    [2]
    """
    return _ROW.pack(t, identifier | EXTENDED_FLAG * extended, len(data), 0, data)


class FrameBuffer:
    """Buffer of rows made from ``can.Message``s.

    A remote frame has no data and gives no row. Sent and received frames are treated
    alike, since peers on one machine see both as sent.

    Parameters
    ----------
    most : capacity, messages

    Attributes
    ----------
    messages_seen : messages processed by the last `fill`

    """

    def __init__(self, most: int) -> None:
        self._most, self._room = most, bytearray(most * _ROW.size)
        self._end = self.messages_seen = 0

    def fill(self, messages: Iterable[Any], buses: Mapping[Any, int]) -> None:
        """Convert messages up to one that cannot be read; its exception is passed on.

        Parameters
        ----------
        messages : as python-can gives them
        buses : number of the bus, by the channel in python-can

        """
        # a log may have 1e8 messages: no call or object for each
        put, room, size, end, remote = _ROW.pack_into, self._room, _ROW.size, 0, 0
        try:
            for message in islice(messages, self._most):
                bus = buses[message.channel]
                if message.is_error_frame:
                    put(room, end, message.timestamp, ERROR_FLAG, 0, bus, b"")
                elif message.is_remote_frame:
                    remote += 1
                    continue
                else:
                    identifier, data = message.arbitration_id, message.data
                    if message.is_extended_id:
                        identifier |= EXTENDED_FLAG
                    put(room, end, message.timestamp, identifier, len(data), bus, data)
                end += size
        finally:
            self._end, self.messages_seen = end, end // size + remote

    @property
    def full(self) -> bool:
        """Whether the buffer is full, so that more messages may follow."""
        return self.messages_seen == self._most

    @property
    def frames(self) -> Frames:
        """The rows."""
        return np.frombuffer(self._room, FRAME_DTYPE, self._end // _ROW.size)
