"""MicroStrain MIP packets of inertial data, set 0x80: ``format=mip``.

A packet is 0x75 0x65, descriptor set, payload length, fields, and Fletcher's two sums
over all before them. A field is its length, its descriptor and big-endian data:

    0x04 acceleration, 3 floats, g          0x05 angular rate, 3 floats, rad/s
    0x14 temperature: least, most, mean, floats, deg C
    0xD5 reference time, ns, 64 bit         0xD3, 0x12 GPS time of week, double, s

Sets other than 0x80 are passed over. Without a time: ``rate=``, or the arrivals. A g
is 9.80665 m/s^2. Source: LORD MicroStrain, MIP protocol and 0x80 data sets.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array, Block
from fieldcal.drivers.checksums import fletcher_sums
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

SYNC = b"\x75\x65"
HEAD, TAIL, LONGEST = 4, 2, 261
INERTIAL = 0x80
ACC, GYR, TEMPERATURE = 0x04, 0x05, 0x14
REFERENCE = 0xD5
TIME_OF_WEEK = (0xD3, 0x12)
WEEK = 604800.0
"""Span of the time of week, s."""


class MipCodec(Codec):
    """Decoder of set 0x80; the option is the rate of a device that sends no time."""

    bauds = (115200, 921600, 230400, 460800)
    longest = LONGEST

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._clock = ChosenTimebase(self.health, options, span=WEEK)

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every 0x75 0x65."""
        return find_headed_frames(data, SYNC, HEAD, LONGEST, _size, _check)

    def reset(self) -> None:
        """Forget half a packet."""
        super().reset()
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Take the samples out of whole packets."""
        parts = [
            _samples(some)
            for some in sort_by_layout(data, found, read_layout)
            if ACC in some.fields or GYR in some.fields
        ]
        return self._timed(self._clock, join_in_frame_order(parts), t_host)


def _size(data: Bytes, starts: Index) -> Index:
    return HEAD + data[starts + 3].astype(np.int64) + TAIL


def _check(data: Bytes, starts: Index, ends: Index) -> Mask:
    body = ends - TAIL
    first, second = fletcher_sums(data, starts, body)
    good: Mask = (first == data[body]) & (second == data[body + 1])
    return good


def _samples(some: SameLayoutFrames) -> RawSamples:
    six = np.hstack([some.numbers(ACC, ">f4", 3) * G0, some.numbers(GYR, ">f4", 3)])
    temperature = some.numbers(TEMPERATURE, ">f4", 3)[:, 2]
    stamps = some.numbers(REFERENCE, ">u8", 1)[:, 0] * 1e-9
    if REFERENCE not in some.fields:
        stamps = some.numbers(some.first_of(TIME_OF_WEEK), ">f8", 1)[:, 0]
    return RawSamples(some.which, six, temperature, stamps, np.full(len(six), np.nan))


SIZES = {ACC: 12, GYR: 12, TEMPERATURE: 12, REFERENCE: 8, 0xD3: 12, 0x12: 12}
"""Bytes of the data of the fields used."""


def read_layout(packet: bytes) -> Layout | None:
    """Where the fields of a packet of inertial data are; None if it is of no use."""
    if packet[2] != INERTIAL:
        return None
    fields, marks, at = {}, [2], HEAD
    while at + 2 <= len(packet) - TAIL:
        length, key = packet[at], packet[at + 1]
        if length < 2 or at + length > len(packet) - TAIL:
            return None
        if SIZES.get(key, length - 2) == length - 2:
            fields[key] = (at + 2, length - 2)
        marks += [at, at + 1]
        at += length
    return Layout(fields, tuple(marks))
