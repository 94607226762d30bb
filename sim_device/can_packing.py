"""What the virtual device puts on a CAN bus: three frames for each sample.

    0x100  ax ay az  20 bits each, low bit first, 0.1 mm/s^2;   counter 4 bits
    0x101  gx gy gz  20 bits each, high bit first, 0.004 deg/s; counter 4 bits
    0x102  time 32 bits, us; temperature 16 bits, 0.01 deg C; 12 bits 0; counter 4 bits

Numbers are in two's complement and clip at their ends; the last frame is low byte
first. A frame of n fields v_i of b_i bits is the integer sum v_i 2^(b_0 + … + b_(i-1))
with the lowest byte first, or, high bit first, the same with the fields in turn from
the top and the highest byte first. The counter is the same in the three frames of one
sample, and wraps at 16, the time after 71 minutes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block

FORCE_LSB = 1e-4
RATE_LSB = float(np.deg2rad(0.004))
DEGREE_LSB = 0.01
TICK_S = 1e-6

IDENTIFIERS = (0x100, 0x101, 0x102)

Integers = NDArray[np.unsignedinteger[Any]]


class CanPacket(NamedTuple):
    """CAN frame of the device: an identifier of 11 bits and 8 bytes."""

    identifier: int
    data: bytes


def frames(block: Block) -> list[CanPacket]:
    """Frames of the samples, sample by sample in the order of the identifiers."""
    count = np.nan_to_num(block.seq).astype(np.uint64) % np.uint64(16)
    force = [_whole(axis, FORCE_LSB, 20) for axis in block.acc.T]
    rate = [_whole(axis, RATE_LSB, 20) for axis in block.gyr.T]
    time = np.rint(block.t / TICK_S).astype(np.int64).astype(np.uint64)
    degrees = _whole(block.temperature, DEGREE_LSB, 16)
    first = _upwards([*force, count], (20, 20, 20, 4))
    second = _upwards([count, *reversed(rate)], (4, 20, 20, 20))
    third = _upwards(
        [time % np.uint64(2**32), degrees, 0 * count, count], (32, 16, 12, 4)
    )
    rows = zip(
        first.astype("<u8").view("V8").tolist(),
        second.astype(">u8").view("V8").tolist(),
        third.astype("<u8").view("V8").tolist(),
        strict=True,
    )
    return [
        CanPacket(identifier, bytes(data))
        for row in rows
        for identifier, data in zip(IDENTIFIERS, row, strict=True)
    ]


def _whole(values: Array, lsb: float, bits: int) -> Integers:
    """Rounded to the last bit, clipped, in two's complement of so many bits."""
    most = 2 ** (bits - 1)
    counts = np.clip(np.rint(np.nan_to_num(values) / lsb), -most, most - 1)
    complement: Integers = (counts.astype(np.int64) + 2**bits).astype(np.uint64)
    return complement % np.uint64(2**bits)


def _upwards(fields: list[Integers], bits: tuple[int, ...]) -> Integers:
    """Fields one above the other, the first at the bottom."""
    word = np.zeros(len(fields[0]), np.uint64)
    for field, width in zip(reversed(fields), reversed(bits), strict=True):
        word = word * np.uint64(2**width) + field
    return word
