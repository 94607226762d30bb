"""Frames of a CAN bus as rows of fixed size, so that many are looked at in one go.

A live bus, a log and a test all hand over the same rows: `pack` makes one, and
``np.frombuffer(data, FRAME)`` reads any number of them.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

LONGEST = 64
"""Bytes of the longest frame, CAN FD."""

FRAME = np.dtype(
    {
        "names": ["t", "id", "size", "bus", "data"],
        "formats": ["<f8", "<u4", "u1", "<u2", ("u1", LONGEST)],
        "offsets": [0, 8, 12, 14, 16],
        "itemsize": 16 + LONGEST,
    }
)
"""Time stamp of the bus, s; identifier; bytes that came; number of the bus in a log of
several; the bytes, then zeros."""

EXTENDED = 1 << 31
"""Added to an identifier of 29 bits."""

ERROR = 1 << 29
"""Identifier of an error frame."""

Frames = NDArray[np.void]

_ROW = struct.Struct(f"<dIBxH{LONGEST}s")


def pack(t: float, identifier: int, extended: bool, data: bytes) -> bytes:
    """One frame as a row.

    >>> np.frombuffer(pack(1.5, 0x123, False, bytes([7, 8])), FRAME)["size"].tolist()
    [2]
    """
    return _ROW.pack(t, identifier | EXTENDED * extended, len(data), 0, data)


class Packed:
    """Rows of ``can.Message``s, packed one behind the other.

    A remote frame, which has no data, gives none. Whether a frame was received or sent
    is not looked at: for peers on one machine both are called sent.

    Parameters
    ----------
    most : messages there is room for

    Attributes
    ----------
    seen : messages that were looked at

    """

    def __init__(self, most: int) -> None:
        self._most, self._room = most, bytearray(most * _ROW.size)
        self._end = self.seen = 0

    def fill(self, messages: Iterable[Any], buses: Mapping[Any, int]) -> None:
        """Pack messages up to one that cannot be read; that raises what it likes.

        Parameters
        ----------
        messages : as python-can hands them over
        buses : number of the bus, by what python-can calls its channel

        """
        # a log has a hundred million of them: a call or an object for each is felt
        put, room, size, end, remote = _ROW.pack_into, self._room, _ROW.size, 0, 0
        try:
            for message in islice(messages, self._most):
                bus = buses[message.channel]
                if message.is_error_frame:
                    put(room, end, message.timestamp, ERROR, 0, bus, b"")
                elif message.is_remote_frame:
                    remote += 1
                    continue
                else:
                    identifier, data = message.arbitration_id, message.data
                    if message.is_extended_id:
                        identifier |= EXTENDED
                    put(room, end, message.timestamp, identifier, len(data), bus, data)
                end += size
        finally:
            self._end, self.seen = end, end // size + remote

    @property
    def full(self) -> bool:
        """Whether there may be more messages than it had room for."""
        return self.seen == self._most

    @property
    def frames(self) -> Frames:
        """The rows."""
        return np.frombuffer(self._room, FRAME, self._end // _ROW.size)
