"""Wire formats as their descriptions put them, for tests of the decoders.

`STREAMS[name]` makes a stream: the options it needs, the bytes of each sample, and the
samples themselves as a decoder should find them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fieldcal.samples import Array, Block

G = 9.80665


class Stream(NamedTuple):
    """What a device sends, sample by sample, and what it means."""

    query: str
    pieces: list[bytes]
    samples: Block


def wit(kind: int, payload: bytes) -> bytes:
    """A WitMotion frame."""
    frame = bytes([0x55, kind]) + payload
    return frame + bytes([sum(frame) % 256])


def wit_time(ms: int) -> bytes:
    """A WitMotion time frame, so many milliseconds after the midnight of 2024-02-29."""
    seconds, ms = divmod(ms, 1000)
    minutes, second = divmod(seconds, 60)
    hour, minute = divmod(minutes, 60)
    fields = struct.pack("<6BH", 24, 2, 29, hour, minute, second, ms)
    return wit(0x50, fields)


def wit_acc(x: int, y: int = 0, z: int = 0, temperature: int = 0) -> bytes:
    """A WitMotion acceleration frame, in counts."""
    return wit(0x51, struct.pack("<4h", x, y, z, temperature))


def wit_gyr(x: int, y: int = 0, z: int = 0) -> bytes:
    """A WitMotion angular rate frame, in counts."""
    return wit(0x52, struct.pack("<4h", x, y, z, 0))


def wit_cycles(n: int) -> list[bytes]:
    """Samples numbered in the first acceleration, every 10 ms."""
    return [wit_time(10 * i) + wit_acc(i) + wit_gyr(i) for i in range(n)]


def witmotion(n: int, rng: np.random.Generator) -> Stream:
    """Stamped WitMotion samples at 100 Hz."""
    raw = rng.integers(-32768, 32768, (n, 7))
    pieces = [
        wit_time(10 * i)
        + wit_acc(*map(int, row[[0, 1, 2, 6]]))
        + wit_gyr(*map(int, row[3:6]))
        for i, row in enumerate(raw)
    ]
    acc = raw[:, :3] * (16 * G / 32768)
    gyr = np.deg2rad(raw[:, 3:6] * (2000 / 32768))
    return Stream("", pieces, Block.of(np.arange(n) / 100, acc, gyr, raw[:, 6] / 100))


def nmea(body: str) -> bytes:
    """A line with the checksum of NMEA 0183."""
    check = 0
    for character in body.encode():
        check ^= character
    return f"${body}*{check:02X}\r\n".encode()


def text(n: int, rng: np.random.Generator) -> Stream:
    """Lines with a checksum, in g and deg/s."""
    six: Array = np.round(rng.normal(size=(n, 6)), 6)
    temperature = np.round(rng.normal(25, 1, n), 2)
    pieces = [
        nmea(f"{i * 0.01:.3f}," + ",".join(f"{x:.6f}" for x in row) + f",{degrees:.2f}")
        for i, (row, degrees) in enumerate(zip(six, temperature, strict=True))
    ]
    acc, gyr = six[:, :3] * G, np.deg2rad(six[:, 3:])
    block = Block.of(np.arange(n) / 100, acc, gyr, temperature)
    return Stream("checksum=xor&acc_unit=g&gyr_unit=deg/s", pieces, block)


STREAMS: dict[str, Callable[[int, np.random.Generator], Stream]] = {
    "text": text,
    "witmotion": witmotion,
}
