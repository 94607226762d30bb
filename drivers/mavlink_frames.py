"""MAVLink packets in a stretch of bytes, version 1 and 2, with or without a signature.

    2:  0xFD length incompatible compatible seq system component id(3) payload crc(2)
    1:  0xFE length seq system component id payload crc(2)

The checksum is CRC-16/MCRF4XX over all behind the first byte, and a byte that stands
for the message's definition (so a message that is not known cannot be checked, and is
passed over). Version 2 leaves out zeros at the end of a payload; a signature is 13
bytes behind the checksum. Source: MAVLink developer guide, Packet Serialization.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.drivers.framing import Bytes, FrameCandidates, FrameScan, Index, Mask

VERSION_1, VERSION_2 = 0xFE, 0xFD
"""First bytes of packets of version 1 and 2."""

HEADER_BYTES = {VERSION_1: 6, VERSION_2: 10}
SIGNATURE_BYTES = 13
LONGEST_PACKET = 10 + 255 + 2 + SIGNATURE_BYTES


class PacketHeaders(NamedTuple):
    """Whole packets: where each is, what it is, and who sent it, all (m,)."""

    starts: Index
    ends: Index
    heads: Index
    payloads: Index
    identifiers: Index
    systems: Index
    components: Index

    def take(self, which: Index) -> PacketHeaders:
        """Return some of them."""
        return PacketHeaders(*(column[which] for column in self))


def packet_candidates(data: Bytes, extras: Index) -> FrameCandidates:
    """Say where packets may begin, and which of them pass their check.

    Parameters
    ----------
    data : the bytes
    extras : by number of the message, the byte of its definition; -1 if not known

    """
    starts = np.flatnonzero((data == VERSION_1) | (data == VERSION_2))
    padded = np.concatenate([data, np.zeros(HEADER_BYTES[VERSION_2], np.uint8)])
    second = padded[starts] == VERSION_2
    heads = np.where(second, HEADER_BYTES[VERSION_2], HEADER_BYTES[VERSION_1])
    flags = np.where(second, padded[starts + 2], 0)
    ends = starts + heads + padded[starts + 1] + 2 + SIGNATURE_BYTES * (flags & 1)
    cut = starts + heads > len(data)
    ends[cut] = len(data) + 1
    extra = extras[np.minimum(_identifiers(padded, starts, second), len(extras) - 1)]
    possible = cut | ((flags < 2) & (extra >= 0))
    starts, ends, extra = starts[possible], ends[possible], extra[possible]
    ends_of_check = ends - SIGNATURE_BYTES * (flags[possible] & 1)
    good = _pass_check(data, starts, ends, ends_of_check, extra)
    return FrameCandidates(starts, ends, good, len(data))


def _identifiers(padded: Bytes, starts: Index, second: Index) -> Index:
    wide = padded[starts + 7] + padded[starts + 8].astype(int) * 256
    wide = wide + padded[starts + 9].astype(int) * 65536
    return np.where(second, wide, padded[starts + 5])


def _pass_check(
    data: Bytes, starts: Index, ends: Index, ends_of_check: Index, extra: Index
) -> Mask:
    """Whether the check of each holds, or it is not whole; inside a good one: no."""
    from fastcrc.crc16 import mcrf4xx

    text, free = data.tobytes(), 0
    good = np.zeros(len(starts), dtype=bool)
    rows = zip(
        starts.tolist(), ends.tolist(), ends_of_check.tolist(), extra.tolist(),
        strict=True,
    )  # fmt: skip
    for i, (start, end, stop, last) in enumerate(rows):
        if start < free:
            continue
        if end > len(text):
            good[i] = True
        elif mcrf4xx(bytes((last,)), mcrf4xx(text[start + 1 : stop - 2])) == (
            text[stop - 2] | text[stop - 1] << 8
        ):
            good[i], free = True, end
    return good


def read_headers(data: Bytes, found: FrameScan) -> PacketHeaders:
    """Read the headers of whole packets."""
    starts = found.starts
    second = data[starts] == VERSION_2
    padded = np.concatenate([data, np.zeros(HEADER_BYTES[VERSION_2], np.uint8)])
    return PacketHeaders(
        starts,
        found.ends,
        np.where(second, HEADER_BYTES[VERSION_2], HEADER_BYTES[VERSION_1]),
        padded[starts + 1].astype(int),
        _identifiers(padded, starts, second),
        np.where(second, padded[starts + 5], padded[starts + 3]).astype(int),
        np.where(second, padded[starts + 6], padded[starts + 4]).astype(int),
    )


def padded_payloads(data: Bytes, some: PacketHeaders, size: int) -> Bytes:
    """Return the first `size` bytes of each payload, (m, size), zeros filled in."""
    column = np.arange(size)
    at = (some.starts + some.heads)[:, None] + column
    filled = column < some.payloads[:, None]
    return np.where(filled, data[np.minimum(at, len(data) - 1)], 0).astype(np.uint8)
