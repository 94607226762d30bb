"""WitMotion WT901 and its kin: ``format=witmotion``.

A frame is 11 bytes: 0x55, kind, four little-endian 16-bit words, and the low byte of
the sum of the ten before it. Kinds used here:

    0x50  year - 2000, month, day, hour, minute, second (a byte each), millisecond
    0x51  acc x, y, z, full scale / 32768 each; temperature, 0.01 deg C
    0x52  gyr x, y, z, full scale / 32768 each

A cycle sends its kinds in ascending order, so a kind that does not ascend begins the
next one. A sample is a 0x52 right behind the 0x51 of its cycle, less than two frames
away: between two further apart the other halves of two cycles may have been lost.

Time comes from the 0x50 of the cycle where the device sends them (1 ms, since midnight
of the first day), else from ``rate=``, else from the arrivals. Source: WitMotion,
WT901 data sheet v20-0702, section 5.1. A g is 9.80665 m/s^2 here.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block, Grain
from fieldcal.drivers.chosen_timebase import ChosenTimebase
from fieldcal.drivers.codec import Codec
from fieldcal.drivers.framing import (
    Bytes,
    FrameCandidates,
    FrameScan,
    Index,
    Mask,
    byte_rows,
)
from fieldcal.drivers.layouts import RawSamples
from fieldcal.drivers.options import Options
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

SIZE = 11
TIME, ACC, GYR = 0x50, 0x51, 0x52

Words: TypeAlias = NDArray[Any]


class WitmotionSamples(NamedTuple):
    """Samples (n, 6), temperatures, stamps, periods since the last, arrivals, (n,)."""

    six: Array
    temperature: Array
    stamp: Array
    steps: Array
    t_host: Array


class WitmotionFrames(NamedTuple):
    """Frames (n, 11), where they stood in the stream, and when they were all there."""

    raw: Bytes
    at: Index
    t_host: Array

    def select(self, which: slice | Mask) -> WitmotionFrames:
        """Return some of them."""
        return WitmotionFrames(
            self.raw[which].copy(), self.at[which], self.t_host[which]
        )


LEAST_UNSTAMPED = 3
"""Samples without a stamp after which the device is taken to send none."""


class WitmotionCodec(Codec):
    """Decoder of 0x50 to 0x52; options acc_range (g), gyr_range (deg/s), rate (Hz)."""

    bauds = (115200, 9600, 921600, 230400, 460800, 57600, 38400, 19200)
    longest = SIZE

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        acc = options.number("acc_range", 16.0, 1.0, 400.0)
        gyr = options.number("gyr_range", 2000.0, 1.0, 40000.0)
        self._acc = acc * ACC_UNITS["g"] / 32768
        self._gyr = gyr * GYR_UNITS["deg/s"] / 32768
        self._clock = ChosenTimebase(self.health, options, resolution=1e-3)
        self._decided = False
        none = np.empty((0, SIZE), np.uint8)
        self._frames = WitmotionFrames(none, np.empty(0, np.int64), np.empty(0))
        self._cycle = 0
        self._paired: int | None = None
        self._held = WitmotionSamples(np.empty((0, 6)), *[np.empty(0)] * 4)
        self._day: int | None = None

    @property
    def grain(self) -> Grain:
        """One count of 16 bits."""
        return Grain(self._acc, self._gyr)

    def scan(self, data: Bytes) -> FrameCandidates:
        """Every 0x55 that a kind follows."""
        at = np.flatnonzero(data[:-1] == 0x55)
        kind = data[at + 1]
        at = at[(kind >= TIME) & (kind <= 0x5F)]
        whole = at[at + SIZE <= len(data)]
        good = np.ones(len(at), dtype=bool)
        # sums of 2, 4 and 8 bytes from every place: two of them make those of 10
        two = data[:-1] + data[1:]
        four = two[:-2] + two[2:]
        eight = four[:-4] + four[4:]
        good[: len(whole)] = eight[whole] + two[whole + 8] == data[whole + 10]
        undecided = len(data) - (len(data) > 0 and int(data[-1]) == 0x55)
        return FrameCandidates(at, at + SIZE, good, undecided)

    def reset(self) -> None:
        """Forget half a frame and half a sample."""
        super().reset()
        self._frames = self._frames.select(slice(0))
        self._paired = None
        self._clock.link_broken()

    def decode(self, data: Bytes, found: FrameScan, t_host: Array) -> Block | None:
        """Put the halves of each sample together."""
        old = self._frames
        frames = WitmotionFrames(
            np.concatenate([old.raw, byte_rows(data, found.starts, SIZE)]),
            np.concatenate([old.at, found.starts + self._begin]),
            np.concatenate([old.t_host, t_host]),
        )
        again = _is_repeat(frames.raw)
        again[: len(old.at)] = False
        if again.any():
            frames = frames.select(~again)
        self._frames = frames.select(slice(-2, None))
        return self._deliver(self._pair(frames, len(old.at)))

    def _pair(self, frames: WitmotionFrames, old: int) -> WitmotionSamples:
        """Samples whose second half is not among the first `old` frames."""
        kind, far = frames.raw[:, 1], np.diff(frames.at) >= 3 * SIZE
        begins = np.zeros(len(kind), dtype=np.int64)
        begins[1:] = kind[1:] <= kind[:-1]
        begins[:old] = 0
        cycle = self._cycle + np.cumsum(begins)
        near = np.zeros(len(kind), dtype=bool)
        near[1:] = (kind[1:] == GYR) & (kind[:-1] == ACC) & ~far
        near[:old] = False
        at = np.flatnonzero(near)
        self._cycle = int(cycle[-1])
        words = np.ascontiguousarray(frames.raw[:, 2:10]).view("<i8")[:, 0]
        first, second = _four(words[at - 1]), _four(words[at])
        six = np.hstack([first[:, :3] * self._acc, second[:, :3] * self._gyr])
        stamp, steps = np.full(len(at), np.nan), np.empty(len(at))
        stamped = (at >= 2) & (kind[at - 2] == TIME) & ~far[at - 2]
        stamp[stamped] = self._seconds(words[at[stamped] - 2])
        if len(at):
            before = cycle[at[0]] - 1 if self._paired is None else self._paired
            steps[:] = np.diff(cycle[at], prepend=before)
            self._paired = int(cycle[at[-1]])
        return WitmotionSamples(six, first[:, 3] / 100, stamp, steps, frames.t_host[at])

    def _seconds(self, words: Words) -> Array:
        """Time in s since midnight of the first day, from words of 0x50, (n,)."""
        date = words & 0xFFFFFF
        begins = np.flatnonzero(np.diff(date, prepend=-1))
        days = np.repeat(_days(date[begins]), np.diff(begins, append=len(date)))
        if self._day is None and len(days):
            self._day = int(days[0])
        hour, minute, second = (words >> place & 0xFF for place in (24, 32, 40))
        clock = ((days - (self._day or 0)) * 24 + hour) * 60 + minute
        seconds: Array = ((clock * 60 + second) * 1000 + (words >> 48)) * 1e-3
        return seconds

    def _deliver(self, samples: WitmotionSamples) -> Block | None:
        """Give samples their time, once it is known whether the device tells it."""
        if not self._decided:
            both = zip(self._held, samples, strict=True)
            samples = WitmotionSamples(*(np.concatenate(columns) for columns in both))
            stamped = np.flatnonzero(~np.isnan(samples.stamp))
            if len(stamped):
                samples = WitmotionSamples(
                    *(column[stamped[0] :] for column in samples)
                )
            elif len(samples.stamp) < LEAST_UNSTAMPED:
                self._held = samples
                return None
            self._decided = True
        six, temperature, stamp, steps, t_host = samples
        n = len(stamp)
        raw = RawSamples(np.arange(n), six, temperature, stamp, np.full(n, np.nan))
        return self._timed(self._clock, raw, t_host, steps)


def _four(words: Words) -> Words:
    """Four words of 16 bits, (m, 4), of one of 64, (m,)."""
    return words.view("<i2").reshape(-1, 4)


def _days(date: Words) -> Words:
    """Days since 1970, (m,), of year - 2000, month and day in a byte each."""
    year, month, day = (date >> place & 0xFF for place in (0, 8, 16))
    months = np.datetime64("2000-01", "M") + (12 * year + month - 1)
    return months.astype("M8[D]").astype(np.int64) + day - 1


def _is_repeat(raw: Bytes) -> Mask:
    """Frames that say word for word what the one before said, (n,)."""
    again = np.zeros(len(raw), dtype=bool)
    again[1:] = raw[1:, 1] == raw[:-1, 1]
    for i in np.flatnonzero(again):
        again[i] = np.array_equal(raw[i], raw[i - 1])
    return again
