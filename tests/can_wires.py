"""Frames as a bus carries them, for tests of what decodes them."""

from __future__ import annotations

import struct
from functools import cache

import numpy as np
import pytest

from fieldcal.core.errors import DeviceError
from fieldcal.core.samples import Array, Block, concat
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import FRAME_DTYPE, Frames, frame_row
from fieldcal.drivers.can_map import FramePart, read_map
from fieldcal.drivers.can_samples import CanAssembler
from fieldcal.drivers.driver import Driver
from fieldcal.drivers.options import Options

DBC = """\
VERSION ""
NS_ :
BS_:
BU_: A

BO_ 32 Force: 8 A
 SG_ ax : 0|16@1- (0.001,0) [0|0] "g" A
 SG_ ay : 16|16@1- (0.001,0) [0|0] "g" A
 SG_ az : 32|16@1- (0.001,0) [0|0] "g" A
 SG_ seq : 48|8@1+ (1,0) [0|0] "" A

BO_ 33 Rate: 8 A
 SG_ gx : 0|16@1- (0.01,0) [0|0] "deg/s" A
 SG_ gy : 16|16@1- (0.01,0) [0|0] "deg/s" A
 SG_ gz : 32|16@1- (0.01,0) [0|0] "deg/s" A
 SG_ seq : 48|8@1+ (1,0) [0|0] "" A

BO_ 34 Climate: 8 A
 SG_ warmth : 0|16@1- (0.01,0) [0|0] "K" A
 SG_ level : 16|8@1+ (1,0) [0|0] "furlong" A
 SG_ bare : 24|8@1+ (1,0) [0|0] "" A
 SG_ frozen : 32|16@1+ (0,0) [0|0] "us" A

VAL_ 32 ax -32768 "not available" ;
"""

KEYED = "ax=ax,ay=ay,az=az,gx=gx,gy=gy,gz=gz,seq=seq"
TURNS = "ax=ax,ay=ay,az=az,gx=gx,gy=gy,gz=gz,temperature=warmth"


def sample(i: int, seq: bool = True) -> list[bytes]:
    """The two frames of a sample numbered in all its channels."""
    rows = []
    for identifier in (32, 33):
        data = struct.pack("<3hBx", i, 2 * i, 3 * i, i % 256 if seq else 0)
        rows.append(frame_row(i / 100 + identifier * 1e-5, identifier, False, data))
    return rows


def climate(degrees: float, t: float = 0.0) -> bytes:
    """A frame of the temperature."""
    return frame_row(
        t, 34, False, struct.pack("<hHI", round((degrees + 273.15) * 100), 0, 0)
    )


def stream(n: int, seq: bool = True) -> list[bytes]:
    """Frames of n samples, one after the other."""
    return [row for i in range(n) for row in sample(i, seq)]


def frames(rows: list[bytes]) -> Frames:
    """All of them at once."""
    return np.frombuffer(b"".join(rows), FRAME_DTYPE)


@cache
def parts(query: str) -> list[FramePart]:
    """Read a map once."""
    return read_map(Options("can", query))


def decode(
    dbc: object, query: str, rows: list[bytes], cuts: list[int] | None = None
) -> tuple[Block, CanLinkHealth]:
    """Samples of the frames, given in pieces cut before these numbers."""
    mapped = f"dbc={dbc}&rate=100{query and '&'}{query}"
    health = CanLinkHealth()
    decoder = CanAssembler(parts(mapped), health, Options("can", mapped))
    edges = [0, *(cuts or []), len(rows)]
    blocks = []
    for start, end in zip(edges[:-1], edges[1:], strict=True):
        some = frames(rows[start:end])
        blocks.append(decoder.feed(some, some["t"].astype(float)))
    return concat(block for block in blocks if block is not None), health


def numbers(block: Block) -> list[int]:
    """The number of each sample, which all six channels agree on."""
    counts: Array = np.hstack(
        [block.acc / (9.80665e-3), np.rad2deg(block.gyr) / 0.01]
    ) / np.array([1, 2, 3, 1, 2, 3])
    whole = np.rint(counts)
    np.testing.assert_allclose(counts, whole, atol=1e-6)
    assert (whole == whole[:, :1]).all(), "frames of two samples in one"
    return [int(number) for number in whole[:, 0]]


def until_the_end(imu: Driver) -> Block:
    """All samples until the device goes."""
    got = []
    with pytest.raises(DeviceError, match="hung up|ended"):
        for block in imu.blocks():
            got.append(block)
    return concat(got)


def until(imu: Driver, wanted: int) -> Block:
    """All samples until there are so many, and those that came with the last."""
    got: list[Block] = []
    for block in imu.blocks():
        got.append(block)
        if sum(map(len, got)) >= wanted:
            break
    return concat([*got, imu.drain()])
