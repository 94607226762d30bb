"""Xsens MTData2 messages: ``format=xsens``.

A message is 0xFA, bus 0xFF, message 0x36, length (0xFF: two more bytes give it), data,
and a byte that makes the sum of all but the first 0 modulo 256. The data are packets
of a 16-bit identifier, a length and big-endian values; the lowest two bits of an
identifier tell what numbers are: float, fixed point 12.20, 16.32 (fraction first), or
double.

    0x4020, 0x4040  acceleration, m/s^2       0x8020, 0x8040  rate of turn, rad/s
    0x0810  temperature, deg C                0x1060  sample time, 32 bit, 0.1 ms
    0x1020  counter of the samples, 16 bit

Without a sample time: ``rate=``, or the arrivals. Source: Xsens MT0101P, MT low level
communication protocol, message MTData2.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.drivers.checksums import byte_sums
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
from fieldcal.drivers.sample_counter import SampleCounter

SYNC = b"\xfa\xff"
HEAD, LONGEST = 6, 2055
MTDATA2 = 0x36
EXTENDED = 0xFF

ACC, GYR = (0x4020, 0x4040), (0x8020, 0x8040)
TEMPERATURE, COUNTER, TIME = 0x0810, 0x1020, 0x1060
TICK = 1e-4
"""Unit of the sample time, s."""

BYTES = (4, 4, 6, 8)
"""Bytes of a number, by the lowest bits of the identifier."""

REALS = {ACC[0]: 3, ACC[1]: 3, GYR[0]: 3, GYR[1]: 3, TEMPERATURE: 1}
COUNTERS = {COUNTER: 2, TIME: 4}


class XsensCodec(Codec):
    """Decoder of MTData2; the option is the rate of a device that sends no time."""

    bauds = (115200, 921600, 460800, 230400, 57600, 2000000)
    longest = LONGEST

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._clock = ChosenTimebase(
            self.health, options, span=2**32 * TICK, since_power_on=True
        )
        self._seq = SampleCounter(span=2**16)

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every 0xFA 0xFF."""
        return find_headed_frames(data, SYNC, HEAD, LONGEST, _size, _check)

    def reset(self) -> None:
        """Forget half a message."""
        super().reset()
        self._seq.link_broken()
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Take the samples out of whole messages."""
        parts = [_samples(some) for some in sort_by_layout(data, found, read_layout)]
        raw = join_in_frame_order(part for part in parts if part is not None)
        steps = None if raw is None else self._seq.steps(raw.seq)
        return self._timed(self._clock, raw, t_host, steps)


def _size(data: Bytes, starts: Index) -> Index:
    short = data[starts + 3].astype(np.int64)
    long = data[starts + 4].astype(np.int64) << 8 | data[starts + 5]
    return np.where(short == EXTENDED, long + 7, short + 5)


def _check(data: Bytes, starts: Index, ends: Index) -> Mask:
    good: Mask = byte_sums(data, starts + 1, ends) == 0
    return good


def read_layout(message: bytes) -> Layout | None:
    """Where the values of a message are, by identifier; None if it is no MTData2."""
    if message[2] != MTDATA2:
        return None
    at = 6 if message[3] == EXTENDED else 4
    fields, marks = {}, [2, 3]
    while at + 3 < len(message):
        key, length = int.from_bytes(message[at : at + 2]), message[at + 2]
        if at + 3 + length > len(message) - 1:
            return None
        kind, precision = key & 0xFFF0, key & 3
        if COUNTERS.get(kind) == length:
            fields[kind] = (at + 3, length)
        elif REALS.get(kind, 0) * BYTES[precision] == length:
            fields[kind | precision] = (at + 3, length)
        marks += [at, at + 1, at + 2]
        at += 3 + length
    return Layout(fields, tuple(marks))


def _samples(some: SameLayoutFrames) -> RawSamples | None:
    acc, gyr = _numbers_of(some, *ACC), _numbers_of(some, *GYR)
    if acc is None and gyr is None:
        return None
    unknown = np.full((len(some.frames), 3), np.nan)
    temperature = _numbers_of(some, TEMPERATURE)
    return RawSamples(
        some.which,
        np.hstack([unknown if part is None else part for part in (acc, gyr)]),
        unknown[:, 0] if temperature is None else temperature[:, 0],
        some.numbers(TIME, ">u4", 1)[:, 0] * TICK,
        some.numbers(COUNTER, ">u2", 1)[:, 0],
    )


def _numbers_of(some: SameLayoutFrames, *kinds: int) -> Array | None:
    """Values of the first of these kinds that there is, (m, n)."""
    key = some.first_of(tuple(kind | p for kind in kinds for p in range(len(BYTES))))
    if key is None:
        return None
    n = REALS[key & 0xFFF0]
    match key & 3:
        case 0:
            return some.numbers(key, ">f4", n)
        case 1:
            return some.numbers(key, ">i4", n) / 2**20
        case 2:
            first, length = some.fields[key]
            numbers = some.frames[:, first : first + length].reshape(-1, n, 6)
            fraction = np.ascontiguousarray(numbers[:, :, :4]).view(">u4")
            whole = np.ascontiguousarray(numbers[:, :, 4:]).view(">i2")
            fixed: Array = (whole + fraction / 2**32)[:, :, 0]
            return fixed
        case _:
            return some.numbers(key, ">f8", n)
