"""WitMotion WT901: each sample as three frames of 11 bytes.

    0x55 0x50  year month day hour minute second  ms(2)      sum    device clock
    0x55 0x51  ax(2) ay(2) az(2)  temperature(2)             sum
    0x55 0x52  gx(2) gy(2) gz(2)  temperature(2)             sum

Words are 16 bit, signed, low byte first: 32768 is 16 g or 2000 °/s, temperature is in
0.01 °C; beyond full scale they clip. The last byte is the low byte of the sum of the
ten before. Years count from 2000. A g is 9.80665 m/s^2. Options: ``acc_range`` in g,
``gyr_range`` in °/s, ``time=0`` leaves the clock out. Source: WT901 datasheet
v20-0702, sections 5.1.1 to 5.1.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block
from fieldcal.sim_device.earth import STANDARD_GRAVITY
from fieldcal.sim_device.wire import Wire

Bytes = NDArray[np.uint8]

SWITCHED_ON = np.datetime64("2024-01-01T00:00:00", "ms")
"""What the device's clock shows at device time 0."""


class WitmotionWire(Wire):
    """Frames of time, acceleration and angular rate."""

    options = {"acc_range": "16", "gyr_range": "2000", "time": "1"}

    def __init__(self, given: dict[str, str]) -> None:
        super().__init__(given)
        self._acc_lsb = self.number("acc_range") * STANDARD_GRAVITY / 32768
        self._gyr_lsb = float(np.deg2rad(self.number("gyr_range"))) / 32768
        self._timed = self.choice("time", ("0", "1")) == "1"

    def encode(self, block: Block) -> bytes:
        """Encode each sample as its frames, one after the other."""
        degrees = _words(block.temperature[:, None] * 100)
        acc = _words(block.acc / self._acc_lsb)
        gyr = _words(block.gyr / self._gyr_lsb)
        frames = [
            _frame(0x51, np.hstack([acc, degrees])),
            _frame(0x52, np.hstack([gyr, degrees])),
        ]
        if self._timed:
            frames.insert(0, _frame(0x50, _clock(block.t)))
        return np.hstack(frames).tobytes()


def _words(values: Array) -> Bytes:
    """Bytes (n, 2 k) of values (n, k), low byte first, clipped at full scale."""
    whole = np.clip(np.rint(np.nan_to_num(values)), -32768, 32767)
    words = np.ascontiguousarray(whole, dtype="<i2")
    return words.view(np.uint8).reshape(len(values), -1)


def _clock(t: Array) -> Bytes:
    """Date and time of day, (n, 8) bytes."""
    now = SWITCHED_ON + np.rint(t * 1000).astype("m8[ms]")
    year, month, day = (now.astype(f"M8[{unit}]") for unit in "YMD")
    ms = (now - day).astype(np.int64)
    columns = [
        year.astype(np.int64) + 1970 - 2000,
        (month - year).astype(np.int64) + 1,
        (day - month).astype(np.int64) + 1,
        ms // 3_600_000,
        ms // 60_000 % 60,
        ms // 1000 % 60,
        ms % 1000 & 0xFF,
        ms % 1000 >> 8,
    ]
    return np.stack(columns, axis=1).astype(np.uint8)


def _frame(kind: int, payload: Bytes) -> Bytes:
    head = np.tile(np.array([0x55, kind], np.uint8), (len(payload), 1))
    body = np.hstack([head, payload])
    return np.hstack([body, body.sum(axis=1, dtype=np.uint8)[:, None]])
