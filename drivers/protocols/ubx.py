"""u-blox UBX-ESF-RAW and UBX-ESF-MEAS: ``format=ubx``.

A message is 0xB5 0x62, class 0x10, number, 16-bit length, payload, and Fletcher's two
sums over all between; everything is little-endian.

    ESF-RAW (0x03)   time, ms; then for each value: data, tag of 24 bits
    ESF-MEAS (0x02)  tag, ms; flags (number of values in bits 11 to 15); id; data ...

Data are 24 bits, signed, and above them the kind: 14, 13, 5 angular rate x, y, z,
2^-12 deg/s; 16, 17, 18 acceleration x, y, z, 2^-10 m/s^2; 12 temperature, 0.01 deg C.
Values with one tag make one sample, also from messages that follow each other. The tag
of ESF-RAW counts 39.0625 us, which u-blox leaves open and is that of the sensor inside;
``tick_us=`` for another. ``message=meas`` takes ESF-MEAS instead. Source: UBX-13003221,
u-blox M8 protocol, UBX-ESF.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, Grain
from fieldcal.drivers.checksums import fletcher_sums
from fieldcal.drivers.chosen_timebase import ChosenTimebase
from fieldcal.drivers.codec import Codec, FormatMatch
from fieldcal.drivers.framing import (
    Bytes,
    FrameCandidates,
    FrameScan,
    Index,
    Mask,
    byte_rows,
    find_headed_frames,
)
from fieldcal.drivers.layouts import RawSamples, join_in_frame_order
from fieldcal.drivers.options import Options

Words = NDArray[np.uint32]

SYNC = b"\xb5\x62"
HEAD, TAIL, LONGEST = 6, 2, 4104
ESF, MEAS, RAW = 0x10, 0x02, 0x03
TICK_US = 39.0625
TAG_BITS = 24

COLUMNS = {16: 0, 17: 1, 18: 2, 14: 3, 13: 4, 5: 5, 12: 6}
"""Columns of acc x, y, z, gyr x, y, z and temperature by the kind of the data."""

SCALES = np.array([2.0**-10] * 3 + [np.deg2rad(2.0**-12)] * 3 + [0.01])
COLUMN = np.full(256, -1)
COLUMN[list(COLUMNS)] = list(COLUMNS.values())


class UbxCodec(Codec):
    """Decoder of ESF-RAW, or of ESF-MEAS with option message=meas."""

    bauds = (38400, 115200, 9600, 921600, 230400, 460800)
    longest = LONGEST

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        meas = options.choice("message", ("raw", "meas"), "raw") == "meas"
        tick = options.number("tick_us", TICK_US, 1e-3, 1e6) * 1e-6
        self._number = MEAS if meas else RAW
        self._tick = 1e-3 if meas else tick
        self._held: Array = np.empty((0, 9))
        self._usual: Mask | None = None
        span = 2**32 * 1e-3 if meas else 2**TAG_BITS * tick
        self._clock = ChosenTimebase(self.health, options, span=span)

    @property
    def grain(self) -> Grain:
        """One count of 24 bits."""
        return Grain(float(SCALES[0]), float(SCALES[3]))

    @classmethod
    def match(cls, data: bytes, seconds: float) -> FormatMatch | None:
        """Judge whether bytes are one or the other message."""
        return cls.match_decoded(data) or cls.match_decoded(data, "message=meas")

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every 0xB5 0x62."""
        return find_headed_frames(data, SYNC, HEAD, LONGEST, _size, _check)

    def reset(self) -> None:
        """Forget half a message."""
        super().reset()
        self._held = self._held[:0]
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Put the values of one tag together."""
        starts, sizes = found.starts, found.ends - found.starts
        ours = (data[starts + 2] == ESF) & (data[starts + 3] == self._number)
        kinds = sizes << 8
        if self._number == MEAS:
            # the flags say how many values there are
            kinds = kinds | data[np.minimum(starts + HEAD + 4, len(data) - 1)] & 0x08
            kinds = kinds | data[np.minimum(starts + HEAD + 5, len(data) - 1)] & 0xF8
        parts = []
        for kind in np.unique(kinds[ours]).tolist():
            which = np.flatnonzero(ours & (kinds == kind))
            payload = byte_rows(data, starts[which], kind >> 8)[:, HEAD:-TAIL]
            read = _meas if self._number == MEAS else _raw
            values = read(payload)
            if values is not None:
                parts.append(_samples(which, *values))
        order = join_in_frame_order(parts)
        if order is None:
            return None
        raw, arrived = self._join(order, t_host[order.which])
        return self._timed(self._clock, raw, arrived)

    def _join(self, raw: RawSamples, t_host: Array) -> tuple[RawSamples, Array]:
        """Put samples of one tag together; hold back the last while it lacks values."""
        ahead = [raw.stamps, t_host, raw.six, raw.temperature]
        joined = _merged(np.vstack([self._held, np.column_stack(ahead)]))
        lacks = int(np.isnan(joined[-1, 2:8]).any())
        self._held = joined[len(joined) - lacks :]
        joined = self._like_the_first(joined[: len(joined) - lacks])
        stamps, temperature = joined[:, 0] * self._tick, joined[:, 8]
        which, unknown = np.arange(len(joined)), np.full(len(joined), np.nan)
        return RawSamples(which, joined[:, 2:8], temperature, stamps, unknown), joined[
            :, 1
        ]

    def _like_the_first(self, joined: Array) -> Array:
        """Leave out samples of ESF-RAW that lack what the first one had.

        A message of it holds whole samples: where a sample is in parts, the message is
        one of the few strange ones that pass the check.
        """
        if self._number == MEAS or not len(joined):
            return joined
        lacks = np.isnan(joined[:, 2:8])
        if self._usual is None:
            self._usual = ~lacks[0]
        if not lacks.any():
            return joined
        alike = ~(lacks & self._usual).any(axis=1)
        self.health.bad += int(np.count_nonzero(~alike))
        return joined[alike]


def _samples(which: Index, words: Words, tags: Index) -> RawSamples:
    """Samples of messages of k values, words and tags (m, k); stamps in ticks."""
    begins = np.ones(tags.shape, dtype=bool)
    begins[:, 1:] = tags[:, 1:] != tags[:, :-1]
    kinds = words >> 24 & 0x3F
    values = (words << 8).view(np.int32) >> 8  # with the sign of 24 bits
    if (kinds == kinds[0]).all() and (begins == begins[0]).all():
        columns = _columns_if_alike(kinds[0], values, begins[0])
    else:
        columns = _columns_one_by_one(kinds.ravel(), values.ravel(), begins.ravel())
    columns *= SCALES
    message = which[np.flatnonzero(begins) // words.shape[1]]
    stamps = tags[begins].astype(float)
    lacks = np.isnan(columns[:, :6])
    some = ~lacks.all(axis=1) if lacks.any() else slice(None)
    six, temperature = columns[some, :6], columns[some, 6]
    unknown = np.full(len(six), np.nan)
    return RawSamples(message[some], six, temperature, stamps[some], unknown)


def _merged(table: Array) -> Array:
    """Join rows that follow each other with one tag, which stands in column 0."""
    begins = np.diff(table[:, 0], prepend=np.nan) != 0
    if begins.all():
        return table
    sample = np.cumsum(begins) - 1
    joined = np.full((sample[-1] + 1, table.shape[1]), np.nan)
    row, column = np.nonzero(~np.isnan(table))
    joined[sample[row], column] = table[row, column]
    return joined


def _columns_if_alike(kinds: Index, values: Index, begins: Mask) -> Array:
    """Columns of samples where all messages hold the same kinds in the same order."""
    sample = np.cumsum(begins) - 1
    columns = np.full((len(values), sample[-1] + 1, len(SCALES)), np.nan)
    for i, column in enumerate(COLUMN[kinds].tolist()):
        if column >= 0:
            columns[:, sample[i], column] = values[:, i]
    return columns.reshape(-1, len(SCALES))


def _columns_one_by_one(kinds: Index, values: Index, begins: Mask) -> Array:
    """Columns of samples, whatever kinds the messages hold."""
    sample = np.cumsum(begins) - 1
    columns = np.full((sample[-1] + 1, len(SCALES)), np.nan)
    column = COLUMN[kinds]
    known = column >= 0
    columns[sample[known], column[known]] = values[known]
    return columns


def _size(data: Bytes, starts: Index) -> Index:
    return HEAD + data[starts + 4] + (data[starts + 5].astype(np.int64) << 8) + TAIL


def _check(data: Bytes, starts: Index, ends: Index) -> Mask:
    body = ends - TAIL
    first, second = fletcher_sums(data, starts + 2, body)
    good: Mask = (first == data[body]) & (second == data[body + 1])
    return good


def _raw(payload: Bytes) -> tuple[Words, Index] | None:
    """Words and tags of ESF-RAW payloads of one size, (m, k) each."""
    if payload.shape[1] < 12 or payload.shape[1] % 8 != 4:
        return None
    pairs = np.ascontiguousarray(payload[:, 4:]).view("<u4").astype(np.uint32)
    return pairs[:, 0::2].copy(), pairs[:, 1::2] & ((1 << TAG_BITS) - 1)


def _meas(payload: Bytes) -> tuple[Words, Index] | None:
    """Words and tags of ESF-MEAS payloads of one size, (m, k) each."""
    if payload.shape[1] < 12:
        return None
    calibrated = int(payload[0, 4]) >> 3 & 1
    count = int(payload[0, 5]) >> 3 or payload.shape[1] // 4 - 2 - calibrated
    if payload.shape[1] < 8 + 4 * count or not count:
        return None
    words = np.ascontiguousarray(payload[:, 8 : 8 + 4 * count]).view("<u4")
    tags = np.ascontiguousarray(payload[:, :4]).view("<u4").astype(np.uint32)
    return words.astype(np.uint32), np.repeat(tags, count, axis=1)
