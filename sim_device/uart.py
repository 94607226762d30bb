"""Bytes that a host receives from a serial line at another bit rate than its own.

A byte is a start bit 0, eight bits from the lowest, a stop bit 1; an idle line is 1.
The host begins a byte at a fall of the line, at t, and samples the line in the middle
of each bit that it expects, at t + (k + 1/2) / rate, k = 1 … 8. Where it finds no stop
bit, a system hands on a zero. Time is counted in bits of the sender.
"""

from __future__ import annotations

import termios

import numpy as np

BITS = 10
"""Bits of a byte on the line, with its start and its stop."""

SPEEDS = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name.startswith("B") and name[1:].isdecimal()
}
"""Bit rates by the numbers that the system has for them."""


def terminal_bit_rate(file: int) -> int:
    """Bit rate that a terminal is set to; 0 if it is none of the usual ones."""
    return SPEEDS.get(termios.tcgetattr(file)[5], 0)


def received_bytes(data: bytes, sent: int, read: int) -> bytes:
    """Bytes that a host reading at `read` bit/s makes of those sent at `sent`.

    >>> received_bytes(b"fieldcal", 9600, 9600)
    b'fieldcal'
    >>> received_bytes(b"U", 9600, 19200) == b"U"
    False
    """
    frames = np.ones((len(data), BITS), np.uint8)
    frames[:, 0] = 0
    bits = np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little")
    frames[:, 1:-1] = bits.reshape(-1, 8)
    line = np.concatenate([[1], frames.ravel(), [1]])
    falls = np.flatnonzero(line[:-1] > line[1:]) + 1
    middles = (np.arange(1, BITS) + 0.5) * sent / read
    out, at = bytearray(), 0.0
    while (next_fall := int(np.searchsorted(falls, at))) < len(falls):
        begin = falls[next_fall]
        # the idle line goes on behind the last byte
        found = line[np.minimum((begin + middles).astype(int), len(line) - 1)]
        whole = int(np.packbits(found[:8], bitorder="little")[0])
        out.append(whole if found[8] else 0)
        at = begin + middles[-1]
    return bytes(out)
