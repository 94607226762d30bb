"""Lines of a Lawicel adapter (slcan) into frames.

    t iii n dd…        frame, identifier of 11 bits in hex, n bytes
    T iiiiiiii n dd…   frame, identifier of 29 bits
    d, D; b, B         CAN FD frames, without and with a faster data rate, n in hex

A line ends with CR; four more hex digits, the adapter's time, may stand before it. What
has any other length or character is no frame. Answers to commands are empty, begin with
z or Z, or are a BEL. Source: Lawicel CANUSB manual 1.0, section 2; CANable 2.0.
"""

from __future__ import annotations

from time import time

from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import frame_row

LONGEST = 1 + 8 + 1 + 128 + 4
"""Characters of the longest line."""

_SIZES = (*range(9), 12, 16, 20, 24, 32, 48, 64)
_DIGITS = {"t": 3, "T": 8, "d": 3, "D": 8, "b": 3, "B": 8}
_HEX_DIGITS = frozenset("0123456789abcdefABCDEF")
_ANSWERS = ("z", "Z", "V", "N", "F", "r", "R")


class LawicelDecoder:
    """A decoder with a memory for the line that is not whole yet."""

    def __init__(self, health: CanLinkHealth) -> None:
        self._health = health
        self._rest = b""

    def feed(self, data: bytes) -> bytes:
        """Return rows of the frames in these bytes, with the time of the host."""
        *lines, self._rest = (self._rest + data).split(b"\r")
        if len(self._rest) > LONGEST:
            self._health.skipped += len(self._rest)
            self._rest = self._rest[-LONGEST:]
        now = time()
        return b"".join([self._row(now, line) for line in lines])

    def _row(self, now: float, line: bytes) -> bytes:
        text = line.lstrip(b"\a").decode("latin-1")
        if not text or text.startswith(_ANSWERS):
            return b""
        kind = text[0]
        try:
            if not _HEX_DIGITS.issuperset(text[1:]):
                raise ValueError
            head = 2 + _DIGITS[kind]
            code = int(text[head - 1], 16)
            if kind in "tT" and code > 8:
                raise ValueError
            body = bytes.fromhex(text[head:])
            size = _SIZES[code]
            if len(body) not in (size, size + 2):
                raise ValueError
            return frame_row(now, int(text[1 : head - 1], 16), head > 5, body[:size])
        except (KeyError, ValueError, IndexError):
            self._health.bad += 1
            return b""
