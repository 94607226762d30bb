"""VectorNav binary output messages: ``format=vectornav``.

A message is 0xFA, a byte that names groups, a little-endian word for each group that
names its fields, the fields in order, and CRC-16/XMODEM, big-endian, over all but the
first byte; taken over the CRC as well it is 0. Used are, in order of preference:

    acceleration, angular rate   group 1 Imu (uncompensated, both), group 3 UncompAccel
                                 and UncompGyro, else Accel and AngularRate
    temperature                  group 1 MagPres, group 3 Temp
    time                         TimeStartup, else TimeGps, ns

The compensated ones have the biases taken out that the device estimates as it runs, so
`source=compensated` must be asked for where they alone are sent. Accelerations are in
m/s^2, angular rates in rad/s. Source: VectorNav UM001 rev. 2.22, section 4; lengths of
fields from the same, tables of the groups.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block
from fieldcal.drivers.checksums import crc16
from fieldcal.drivers.chosen_timebase import ChosenTimebase
from fieldcal.drivers.codec import Codec
from fieldcal.drivers.framing import Bytes, FrameCandidates, FrameScan, Index
from fieldcal.drivers.layouts import (
    Layout,
    RawSamples,
    SameLayoutFrames,
    join_in_frame_order,
    sort_by_layout,
)
from fieldcal.drivers.options import Options

SYNC = 0xFA
LONGEST = 600
"""Longest message that is taken for one, bytes."""

LENGTHS = (
    (8, 8, 8, 12, 16, 12, 24, 12, 12, 24, 20, 28, 2, 4, 8),
    (8, 8, 8, 2, 8, 8, 8, 4, 4, 1),
    (2, 12, 12, 12, 4, 4, 16, 12, 12, 12, 12, 2, 40),
    (8, 8, 2, 1, 1, 24, 24, 12, 12, 12, 4, 4, 2, 28),
    (2, 12, 16, 36, 12, 12, 12, 12, 12, 12, 28, 24),
    (2, 24, 24, 12, 12, 12, 12, 12, 12, 4, 4, 68, 64),
)
"""Bytes of each field of groups 1 to 6."""

IMU, ACCEL, RATE, MAG_PRES = 1 << 8 | 9, 1 << 8 | 8, 1 << 8 | 5, 1 << 8 | 10
UNCOMP_ACCEL, UNCOMP_GYRO = 3 << 8 | 2, 3 << 8 | 3
ACCEL_3, RATE_3, TEMPERATURE = 3 << 8 | 9, 3 << 8 | 10, 3 << 8 | 4
STARTUP = (1 << 8 | 0, 2 << 8 | 0)
GPS = (1 << 8 | 1, 2 << 8 | 1)
"""Fields, as group << 8 | bit."""

UNCOMPENSATED = ((IMU, IMU), (UNCOMP_ACCEL, UNCOMP_GYRO))
COMPENSATED = ((ACCEL, RATE), (ACCEL_3, RATE_3))


def _totals() -> Index:
    """Bytes of the fields that a word names, (groups, 65536); -1 if it names none."""
    words = np.arange(1 << 16)
    totals = np.zeros((len(LENGTHS), len(words)), dtype=np.int64)
    for group, lengths in enumerate(LENGTHS):
        for bit in range(16):
            named = words >> bit & 1 == 1
            totals[group, named] += lengths[bit] if bit < len(lengths) else -(1 << 20)
    totals[:, 0] = -1
    return np.maximum(totals, -1)


TOTALS = _totals()


class VectornavCodec(Codec):
    """Decoder of the messages that carry accelerations and angular rates."""

    bauds = (115200, 921600, 230400, 460800, 57600, 128000)
    longest = LONGEST

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        source = options.choice(
            "source", ("uncompensated", "compensated"), "uncompensated"
        )
        self._pairs = COMPENSATED if source == "compensated" else UNCOMPENSATED
        self._clock = ChosenTimebase(self.health, options, since_power_on=True)

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every 0xFA that a possible header follows."""
        starts, ends, undecided = _lengths(data)
        good = np.ones(len(starts), dtype=bool)
        whole = np.flatnonzero(ends <= len(data))
        good[whole] = crc16(data, starts[whole] + 1, ends[whole]) == 0
        return FrameCandidates(starts, ends, good, undecided)

    def reset(self) -> None:
        """Forget half a message."""
        super().reset()
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Take the samples out of whole messages."""
        parts = []
        for some in sort_by_layout(data, found, read_layout):
            pair = next((p for p in self._pairs if set(p) <= set(some.fields)), None)
            if pair is not None:
                parts.append(_samples(some, pair))
        return self._timed(self._clock, join_in_frame_order(parts), t_host)


def _samples(some: SameLayoutFrames, pair: tuple[int, int]) -> RawSamples:
    acc, gyr = (some.numbers(key, "<f4", 6 if key == IMU else 3) for key in pair)
    temperature = some.numbers(TEMPERATURE, "<f4", 1)
    if MAG_PRES in some.fields:
        temperature = some.numbers(MAG_PRES, "<f4", 4)
    stamps = some.numbers(some.first_of(STARTUP + GPS), "<u8", 1)[:, 0] * 1e-9
    six = np.hstack([acc[:, :3], gyr[:, -3:]])
    return RawSamples(
        some.which, six, temperature[:, -1], stamps, np.full(len(six), np.nan)
    )


def _lengths(data: Bytes) -> tuple[Index, Index, int]:
    """Where messages may begin and end, and the first byte that cannot be told yet."""
    padded = np.concatenate([data, np.zeros(2 + 2 * len(LENGTHS), np.uint8)])
    at = np.flatnonzero(data == SYNC)
    at = at[padded[at + 1] < 1 << len(LENGTHS)]
    groups = padded[at + 1]
    word = at + 2
    payload = np.zeros(len(at), dtype=np.int64)
    possible = groups > 0
    for group, totals in enumerate(TOTALS):
        has = np.flatnonzero(groups >> group & 1)
        low, high = padded[word[has]], padded[word[has] + 1]
        total = totals[low | high.astype(np.int64) << 8]
        possible[has] &= total > 0
        payload[has] += total
        word[has] += 2
    ends = word + payload + 2
    possible &= ends - at <= LONGEST
    short = word > len(data)
    keep = possible & ~short
    # a header that is cut off may be anything
    undecided = at[short]
    return at[keep], ends[keep], int(undecided[0]) if len(undecided) else len(data)


def read_layout(frame: bytes) -> Layout:
    """Where the fields of a message are."""
    present = [g for g in range(len(LENGTHS)) if frame[1] >> g & 1]
    first = 2 + 2 * len(present)
    marks = tuple(range(1, first))
    fields = {}
    for i, group in enumerate(present):
        word = int.from_bytes(frame[2 + 2 * i : 4 + 2 * i], "little")
        for bit, length in enumerate(LENGTHS[group]):
            if word >> bit & 1:
                fields[group + 1 << 8 | bit] = (first, length)
                first += length
    return Layout(fields, marks)
