"""Frames of a CAN bus as rows of fixed size, so that many are looked at in one go.

A live bus, a log and a test all hand over the same rows: `pack` makes one, and
``np.frombuffer(data, FRAME)`` reads any number of them.
"""

from __future__ import annotations

import struct
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


def pack_message(message: Any, bus: int = 0) -> bytes:
    """Pack a ``can.Message``; nothing of a remote frame, which has no data.

    Whether it was received or sent is not looked at: for peers on one machine both are
    called sent.
    """
    if message.is_error_frame:
        return _ROW.pack(message.timestamp, ERROR, 0, bus, b"")
    if message.is_remote_frame:
        return b""
    identifier = message.arbitration_id
    if message.is_extended_id:
        identifier |= EXTENDED
    data = message.data
    return _ROW.pack(message.timestamp, identifier, len(data), bus, data)
