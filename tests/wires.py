"""Wire formats as their descriptions put them, for tests of the decoders.

`STREAMS[name]` makes a stream: the options it needs, the bytes of each sample, and the
samples themselves as a decoder should find them.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array, Block

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


def crc16_xmodem(data: bytes) -> int:
    """CRC with the polynomial x^16 + x^12 + x^5 + 1, as Python's library has it."""
    return crc_hqx(data, 0)


def fletcher(data: bytes) -> bytes:
    """Fletcher's two sums, byte by byte."""
    first = second = 0
    for byte in data:
        first = (first + byte) % 256
        second = (second + first) % 256
    return bytes([first, second])


def floats(n: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Times every 10 ms, (n, 6) and temperatures as single precision holds them."""
    six = rng.normal(size=(n, 6)).astype(np.float32).astype(float)
    degrees = rng.normal(25, 1, n).astype(np.float32).astype(float)
    return np.arange(n) / 100, six, degrees


def vn_message(t: float, six: Array, degrees: float) -> bytes:
    """VectorNav group 1: TimeStartup, AngularRate, Accel, Imu, MagPres."""
    values = [*six[3:] + 1, *six[:3] + 1, *six, 0.2, 0.1, -0.5, degrees, 101.3]
    body = b"\x01\x21\x07" + struct.pack("<Q17f", round(t * 1e9), *values)
    return b"\xfa" + body + crc16_xmodem(body).to_bytes(2, "big")


def vectornav(n: int, rng: np.random.Generator) -> Stream:
    """VectorNav messages whose compensated values are others."""
    t, six, degrees = floats(n, rng)
    pieces = [vn_message(*row) for row in zip(t, six, degrees, strict=True)]
    return Stream("", pieces, Block.of(t, six[:, :3], six[:, 3:], degrees))


def vnimu(n: int, rng: np.random.Generator) -> Stream:
    """$VNIMU lines."""
    six = np.round(rng.normal(size=(n, 6)), 3)
    degrees = np.round(rng.normal(25, 1, n), 1)
    pieces = []
    for row, temperature in zip(six, degrees, strict=True):
        fields = ["+0.2", "-0.1", "+0.5", *(f"{x:+08.3f}" for x in row)]
        pieces.append(nmea(",".join(["VNIMU", *fields, f"{temperature:+.1f}", "99.2"])))
    block = Block.of(np.arange(n) / 100, six[:, :3], six[:, 3:], degrees)
    return Stream("rate=100", pieces, block)


def mip_packet(descriptor: int, *fields: tuple[int, bytes]) -> bytes:
    """A MicroStrain packet of (descriptor, data)."""
    parts = (bytes([len(data) + 2, key]) + data for key, data in fields)
    payload = b"".join(parts)
    packet = bytes([0x75, 0x65, descriptor, len(payload)]) + payload
    return packet + fletcher(packet)


def mip(n: int, rng: np.random.Generator) -> Stream:
    """MicroStrain packets of set 0x80, among them some of set 0x82."""
    t, six, degrees = floats(n, rng)
    pieces = []
    for i in range(n):
        packet = mip_packet(
            0x80,
            (0x04, struct.pack(">3f", *six[i, :3])),
            (0x05, struct.pack(">3f", *six[i, 3:])),
            (0x14, struct.pack(">3f", -10, 60, degrees[i])),
            (0xD5, struct.pack(">Q", i * 10_000_000)),
        )
        other = mip_packet(0x82, (0x10, bytes(6))) if i % 5 == 0 else b""
        pieces.append(other + packet)
    return Stream("", pieces, Block.of(t, six[:, :3] * G, six[:, 3:], degrees))


def mtdata2(*packets: tuple[int, bytes]) -> bytes:
    """An Xsens message of (identifier, value)."""
    parts = (struct.pack(">HB", key, len(value)) + value for key, value in packets)
    data = b"".join(parts)
    size = [len(data)] if len(data) < 255 else [255, *len(data).to_bytes(2, "big")]
    body = bytes([0xFF, 0x36, *size]) + data
    return b"\xfa" + body + bytes([-sum(body) % 256])


def xsens(n: int, rng: np.random.Generator) -> Stream:
    """Xsens messages in single precision."""
    t, six, degrees = floats(n, rng)
    pieces = [
        mtdata2(
            (0x1020, struct.pack(">H", (i + 65500) % 65536)),
            (0x1060, struct.pack(">I", 100 * i)),
            (0x4020, struct.pack(">3f", *six[i, :3])),
            (0x8020, struct.pack(">3f", *six[i, 3:])),
            (0x0810, struct.pack(">f", degrees[i])),
        )
        for i in range(n)
    ]
    return Stream("", pieces, Block.of(t, six[:, :3], six[:, 3:], degrees))


def ubx_message(number: int, payload: bytes) -> bytes:
    """A u-blox message of class ESF."""
    body = bytes([0x10, number]) + struct.pack("<H", len(payload)) + payload
    return b"\xb5\x62" + body + fletcher(body)


def ubx_word(kind: int, value: int) -> bytes:
    """Kind and 24-bit value."""
    return struct.pack("<I", kind << 24 | value & 0xFFFFFF)


def ubx(n: int, rng: np.random.Generator) -> Stream:
    """ESF-RAW every 10 ms, wrapping its counter."""
    raw = rng.integers(-(2**23), 2**23, (n, 6))
    degrees = rng.integers(1000, 4000, n)
    pieces = []
    for i in range(n):
        tag = struct.pack("<I", (i * 256 + 2**24 - 5000) % 2**24)
        values = zip((16, 17, 18, 14, 13, 5), raw[i].tolist(), strict=True)
        words = [ubx_word(12, int(degrees[i])), *(ubx_word(*v) for v in values)]
        pieces.append(ubx_message(3, bytes(4) + b"".join(w + tag for w in words)))
    acc, gyr = raw[:, :3] / 1024, np.deg2rad(raw[:, 3:] / 4096)
    return Stream("", pieces, Block.of(np.arange(n) / 100, acc, gyr, degrees / 100))


ILABS_G = 9.8106
ILABS = {0x01: "<I", 0x3C: "<H", 0x23: "<3i", 0x21: "<3i", 0x26: "<7b", 0x52: "<h"}


def ilabs(*values: tuple[int, tuple[int, ...]]) -> bytes:
    """An InertialLabs packet of (identifier, numbers)."""
    names = bytes([len(values), *(name for name, _ in values)])
    data = names + b"".join(struct.pack(ILABS[n], *v) for n, v in values)
    body = bytes([0x01, 0x95]) + struct.pack("<H", len(data) + 6) + data
    return b"\xaa\x55" + body + struct.pack("<H", sum(body) % 65536)


def inertiallabs(n: int, rng: np.random.Generator) -> Stream:
    """InertialLabs packets at 100 Hz across the end of a week."""
    raw, degrees = rng.integers(-(2**24), 2**24, (n, 6)), rng.integers(-400, 900, n)
    pieces = [
        ilabs(
            (0x01, ((604_799_500 + 10 * i) % 604_800_000,)),
            (0x3C, (2300,)),
            (0x23, tuple(raw[i, :3].tolist())),
            (0x21, tuple(raw[i, 3:].tolist())),
            (0x26, (1, -2, 3, 0, 0, 0, 0)),
            (0x52, (int(degrees[i]),)),
        )
        for i in range(n)
    ]
    acc, gyr = raw[:, :3] * 1e-6 * ILABS_G, np.deg2rad(raw[:, 3:] * 1e-5)
    t = 604_799.5 + np.arange(n) / 100
    return Stream("", pieces, Block.of(t, acc, gyr, degrees / 10))


STREAMS: dict[str, Callable[[int, np.random.Generator], Stream]] = {
    "inertiallabs": inertiallabs,
    "mip": mip,
    "text": text,
    "ubx": ubx,
    "vectornav": vectornav,
    "vnimu": vnimu,
    "witmotion": witmotion,
    "xsens": xsens,
}
