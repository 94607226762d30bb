"""A telemetry log (.tlog) played: each packet behind its host time.

Eight bytes, big-endian: µs since 1970 at which the packet arrived; then the packet. A
log that was cut off or spoiled goes on at the next byte that can begin a packet.
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
    chunks, at, last = [], 0, len(data) - STAMP_BYTES - 3
    while at <= last:
        body = at + STAMP_BYTES
        if data[body] not in HEADER_BYTES:
            at += 1
            continue
        signed = data[body] == VERSION_2 and data[body + 2] & 1
        size = HEADER_BYTES[data[body]] + data[body + 1] + 2 + SIGNATURE_BYTES * signed
        if body + size > len(data):
            break
        stamp = int.from_bytes(data[at:body], "big") / 1e6
        chunks.append(Chunk(stamp, data[body : body + size]))
        at = body + size
    return chunks, at


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
