"""A telemetry log (.tlog) played: each packet behind its host time.

Eight bytes, big-endian: µs since 1970 at which the packet arrived; then the packet. A
log that was cut off or spoiled goes on at the next byte that can begin a packet: one
whose time is near that of the packet before, or behind.
"""

from __future__ import annotations

import gzip
from bisect import bisect_right
from pathlib import Path

from fieldcal.core.errors import InputError, RecordingEnded
from fieldcal.drivers.mavlink_frames import HEADER_BYTES, SIGNATURE_BYTES, VERSION_2
from fieldcal.drivers.playback import PlaybackClock
from fieldcal.drivers.reader import Chunk

STAMP_BYTES = 8
A_DAY_US = 86400 * 10**6
"""Longest time between packets that need no other sign to be packets. The clock of a
computer may be set by more while it records."""

PACKETS_AT_ONCE = 4096
"""Packets delivered at once."""


def is_mavlink_log(place: str) -> bool:
    """Tell whether an address names a log and no link.

    >>> is_mavlink_log("flight.tlog"), is_mavlink_log("udp:0.0.0.0:14550")
    (True, False)
    """
    return place.lower().removesuffix(".gz").endswith(".tlog")


def split_log(data: bytes) -> list[Chunk]:
    """Cut a log into packets with their arrivals, s since 1970."""
    chunks, at = split_whole_packets(data)
    rest = data[at + STAMP_BYTES :]
    if len(rest) >= 3 and rest[0] in HEADER_BYTES:
        chunks.append(
            Chunk(int.from_bytes(data[at : at + STAMP_BYTES], "big") / 1e6, rest)
        )
    return chunks


def split_whole_packets(data: bytes) -> tuple[list[Chunk], int]:
    """Cut a stretch of a log into whole packets; where the next one begins."""
    chunks: list[Chunk] = []
    at, last, before = 0, len(data) - STAMP_BYTES - 3, None
    while at <= last:
        body = at + STAMP_BYTES
        if data[body] not in HEADER_BYTES:
            at += 1
            continue
        signed = data[body] == VERSION_2 and data[body + 2] & 1
        size = HEADER_BYTES[data[body]] + data[body + 1] + 2 + SIGNATURE_BYTES * signed
        if body + size > len(data):
            if chunks and not _is_near(data, at, before):
                at += 1  # garbage may state any size
                continue
            break
        if not (_is_near(data, at, before) or _goes_on(data, at, body + size)):
            at += 1
            continue
        before = _stamp(data, at)
        chunks.append(Chunk(before / 1e6, data[body : body + size]))
        at = body + size
    return chunks, at


def _stamp(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + STAMP_BYTES], "big")


def _is_near(data: bytes, at: int, before: int | None) -> bool:
    """Whether a packet has about the time of the one before."""
    return before is not None and abs(_stamp(data, at) - before) < A_DAY_US


def _goes_on(data: bytes, at: int, end: int) -> bool:
    """Whether a packet ends the data, or is followed by one of about its time."""
    body = end + STAMP_BYTES
    if body >= len(data):
        return True
    return data[body] in HEADER_BYTES and _is_near(data, end, _stamp(data, at))


class PlayedMavlinkLog:
    """A log that is played.

    Parameters
    ----------
    path : the file, also .gz
    speed : time of the log against the clock; inf for as fast as it is read

    Raises
    ------
    InputError
        If there is no such file, or it is no log.

    """

    def __init__(self, path: Path, speed: float) -> None:
        self._path = path
        try:
            data = path.read_bytes()
            if path.suffix.lower() == ".gz":
                data = gzip.decompress(data)
        except (OSError, EOFError) as fault:
            raise InputError(f"{path}: cannot be read: {fault}") from fault
        self._chunks = split_log(data)
        if not self._chunks:
            raise InputError(f"{path}: holds no packet; check that it is a .tlog")
        self._next = 0
        self.now = self._chunks[0].t_host
        self._pace = PlaybackClock(self.now, speed)

    def take(self, timeout: float) -> list[Chunk]:
        """Return the packets that are due, or none after `timeout` seconds.

        Raises
        ------
        RecordingEnded
            At the end of the log.

        """
        if self._next >= len(self._chunks):
            seconds = self._chunks[-1].t_host - self._chunks[0].t_host
            raise RecordingEnded(self._path, seconds)
        end = min(self._next + PACKETS_AT_ONCE, len(self._chunks))
        until = self._pace.wait(self._chunks[self._next].t_host, timeout)
        end = bisect_right(
            self._chunks, until, self._next, end, key=lambda chunk: chunk.t_host
        )
        taken = self._chunks[self._next : end]
        self._next = end
        if taken:
            self.now = taken[-1].t_host
        return taken
