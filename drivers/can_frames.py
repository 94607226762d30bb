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
        "names": ["t", "id", "size", "data"],
        "formats": ["<f8", "<u4", "u1", ("u1", LONGEST)],
        "offsets": [0, 8, 12, 16],
        "itemsize": 16 + LONGEST,
    }
)
"""Time stamp of the bus, s; identifier; bytes that came; these bytes, then zeros."""

EXTENDED = 1 << 31
"""Added to an identifier of 29 bits."""

ERROR = 1 << 29
"""Identifier of an error frame."""

Frames = NDArray[np.void]

_ROW = struct.Struct(f"<dIB3x{LONGEST}s")


def pack(t: float, identifier: int, extended: bool, data: bytes) -> bytes:
    """One frame as a row.

    >>> np.frombuffer(pack(1.5, 0x123, False, bytes([7, 8])), FRAME)["size"].tolist()
    [2]
    """
    return _ROW.pack(t, identifier | EXTENDED * extended, len(data), data)


def pack_message(message: Any) -> bytes:
    """Pack a ``can.Message``; nothing of a remote frame, which has no data.

    Whether it was received or sent is not looked at: for peers on one machine both are
    called sent.
    """
    if message.is_error_frame:
        return pack(message.timestamp, ERROR, False, b"")
    if message.is_remote_frame:
        return b""
    identifier = message.arbitration_id
    if message.is_extended_id:
        identifier |= EXTENDED
    return _ROW.pack(message.timestamp, identifier, len(message.data), message.data)
