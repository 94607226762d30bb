"""Xsens: each sample as an MTData2 message.

    0xFA 0xFF 0x36 length  0x1020 counter(2)  0x1060 time(4)  0x402p acceleration
    0x802p rate of turn  0x081p temperature  checksum

Big-endian, each value behind its identifier and length; time in 0.1 ms, m/s^2, rad/s,
deg C. The last digit p tells the numbers, option ``numbers``: float, 12.20, 16.32,
double. The checksum makes the sum of all but the first byte 0 modulo 256. Source:
MT0101P, MT low level communication protocol.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Block
from fieldcal.sim_device.wire import Wire

NUMBERS = ("float", "12.20", "16.32", "double")
Bytes = NDArray[np.uint8]
Numbers: TypeAlias = NDArray[Any]


class XsensWire(Wire):
    """MTData2 messages."""

    options = {"numbers": "float"}

    def __init__(self, given: dict[str, str]) -> None:
        super().__init__(given)
        self._precision = NUMBERS.index(self.choice("numbers", NUMBERS))

    def encode(self, block: Block) -> bytes:
        """Encode each sample as one message."""
        seq = np.nan_to_num(block.seq).astype(np.int64) % 2**16
        ticks = np.rint(block.t * 1e4).astype(np.int64) % 2**32
        parts = [
            _packet(0x1020, _bytes(seq, ">u2")),
            _packet(0x1060, _bytes(ticks, ">u4")),
            self._real(0x4020, block.acc),
            self._real(0x8020, block.gyr),
            self._real(0x0810, block.temperature[:, None]),
        ]
        data = np.hstack(parts)
        head = np.tile(
            np.array([0xFA, 0xFF, 0x36, data.shape[1]], np.uint8), (len(data), 1)
        )
        body = np.hstack([head, data])
        check = -body[:, 1:].sum(axis=1, dtype=np.uint8)
        return np.hstack([body, check[:, None]]).tobytes()

    def _real(self, identifier: int, values: Array) -> Bytes:
        if self._precision == 0:
            content = _bytes(values, ">f4")
        elif self._precision == 1:
            content = _bytes(np.rint(values * 2**20), ">i4")
        elif self._precision == 2:
            fixed = np.rint(values * 2.0**32).astype(np.int64)
            fraction, whole = _bytes(fixed, ">u4"), _bytes(fixed >> 32, ">i2")
            pair = [part.reshape(*values.shape, -1) for part in (fraction, whole)]
            content = np.concatenate(pair, axis=2).reshape(len(values), -1)
        else:
            content = _bytes(values, ">f8")
        return _packet(identifier | self._precision, content)


def _bytes(values: Numbers, kind: str) -> Bytes:
    """Bytes of numbers (n,) or (n, k) as dtype `kind`, (n, bytes)."""
    numbers = np.ascontiguousarray(values.astype(kind))
    return numbers.view(np.uint8).reshape(len(values), -1)


def _packet(identifier: int, content: Bytes) -> Bytes:
    head = [identifier >> 8, identifier & 0xFF, content.shape[1]]
    return np.hstack([np.tile(np.array(head, np.uint8), (len(content), 1)), content])
