"""InertialLabs packets of user-defined data: ``format=inertiallabs``.

A packet is 0xAA 0x55, type 0x01, identifier 0x95, its length less two (16 bit), how
many values there are, an identifier of each, the values in this order, little-endian,
and the sum of all but the first two bytes (16 bit).

    0x01  time of the GNSS week, ms         0x23  acceleration, 3 x 32 bit, 1e-6 g
    0x52  temperature, 0.1 deg C            0x21  rate of turn, 3 x 32 bit, 1e-5 deg/s

1 g is 9.8106 m/s^2 in these devices. Axes are right, forward, up, as sent. Behind an
identifier of unknown length nothing is read. Without a time: ``rate=``, or the
arrivals. Source: ArduPilot, AP_ExternalAHRS_InertialLabs, and its simulator.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block, Grain
from fieldcal.drivers.checksums import word_sums
from fieldcal.drivers.chosen_timebase import ChosenTimebase
from fieldcal.drivers.codec import Codec
from fieldcal.drivers.framing import (
    Bytes,
    FrameCandidates,
    FrameScan,
    Index,
    Mask,
    find_headed_frames,
)
from fieldcal.drivers.layouts import (
    Layout,
    RawSamples,
    SameLayoutFrames,
    join_in_frame_order,
    sort_by_layout,
)
from fieldcal.drivers.options import Options

SYNC = b"\xaa\x55"
HEAD, LONGEST = 6, 1024
KIND = (0x01, 0x95)

TIME, ACC, GYR, TEMPERATURE = 0x01, 0x23, 0x21, 0x52
WEEK = 604800.0
"""Time after which the stamps begin anew, s."""

G = 9.8106
"""m/s^2; what these devices call g."""

ACC_UNIT, GYR_UNIT = 1e-6 * G, float(np.deg2rad(1e-5))

LENGTHS = {
    **dict.fromkeys((0x3B, 0x41, 0xC0, 0x3A, 0x54, 0x38, 0x39, 0x9A), 1),
    **dict.fromkeys((0x3C, 0x53, 0x4A, 0x36, 0x86, 0x85, 0x8D, 0x50, 0x52, 0x5A), 2),
    **dict.fromkeys((0x3D, 0x65, 0xA1, 0x61), 2),
    **dict.fromkeys((0x58,), 3),
    **dict.fromkeys((0x01, 0x3E, 0x28, 0x33, 0x40), 4),
    **dict.fromkeys((0x25, 0x24, 0x07, 0x57, 0x8A, 0x6C, 0x66), 6),
    **dict.fromkeys((0x26,), 7),
    **dict.fromkeys((0x37, 0x6B, 0x62), 8),
    **dict.fromkeys((0x32, 0x42), 10),
    **dict.fromkeys((0x23, 0x21, 0x12, 0x10, 0x30), 12),
    **dict.fromkeys((0x6E,), 14),
    **dict.fromkeys((0x5F,), 24),
}
"""Bytes of each value, by its identifier."""


class InertialLabsCodec(Codec):
    """Decoder of user-defined data; the option is the rate without a time."""

    bauds = (460800, 115200, 921600, 230400, 57600)
    longest = LONGEST

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._clock = ChosenTimebase(self.health, options, resolution=1e-3, span=WEEK)

    @property
    def grain(self) -> Grain:
        """One count."""
        return Grain(ACC_UNIT, GYR_UNIT)

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every 0xAA 0x55."""
        return find_headed_frames(data, SYNC, HEAD, LONGEST, _size, _check)

    def reset(self) -> None:
        """Forget half a packet."""
        super().reset()
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Take the samples out of whole packets."""
        parts = [_samples(some) for some in sort_by_layout(data, found, read_layout)]
        raw = join_in_frame_order(part for part in parts if part is not None)
        return self._timed(self._clock, raw, t_host)


def _size(data: Bytes, starts: Index) -> Index:
    low, high = (data[starts + i].astype(np.int64) for i in (4, 5))
    size: Index = (low | high << 8) + 2
    return size


def _check(data: Bytes, starts: Index, ends: Index) -> Mask:
    enough = ends - starts >= HEAD + 3
    good = np.zeros(len(starts), dtype=bool)
    first, last = starts[enough], ends[enough]
    said = data[last - 2].astype(np.uint16) | data[last - 1].astype(np.uint16) << 8
    good[enough] = word_sums(data, first + 2, last - 2) == said
    return good


def read_layout(packet: bytes) -> Layout | None:
    """Where the values of a packet are, by identifier; None if it is no such packet."""
    if (packet[2], packet[3]) != KIND:
        return None
    count = packet[HEAD]
    at, end = HEAD + 1 + count, len(packet) - 2
    if at > end:
        return None
    fields = {}
    for key in packet[HEAD + 1 : at]:
        length = LENGTHS.get(key, 0)
        if not length or at + length > end:
            break
        fields[key] = (at, length)
        at += length
    return Layout(fields, (2, 3, *range(HEAD, HEAD + 1 + count)))


def _samples(some: SameLayoutFrames) -> RawSamples | None:
    if ACC not in some.fields and GYR not in some.fields:
        return None
    six = np.hstack(
        [
            some.numbers(ACC, "<i4", 3) * ACC_UNIT,
            some.numbers(GYR, "<i4", 3) * GYR_UNIT,
        ]
    )
    return RawSamples(
        some.which,
        six,
        some.numbers(TEMPERATURE, "<i2", 1)[:, 0] / 10,
        some.numbers(TIME, "<u4", 1)[:, 0] * 1e-3,
        np.full(len(some.frames), np.nan),
    )
