"""InertialLabs: each sample as a packet of 32 values, as an INS sends them.

    0xAA 0x55  0x01 0x95  length - 2 (2)  32  32 identifiers  156 bytes  sum (2)

Little-endian: time in ms of the GNSS week, accelerations in 1e-6 g with g = 9.8106
m/s^2, rates in 1e-5 deg/s, temperature in 0.1 deg C; all that a navigator adds is 0.
The sum is over all but the first two bytes, 16 bit. Source: ArduPilot's simulator of
the device.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.sim_device.wire import Wire

NAMES = bytes.fromhex(
    "013c232125240712105857534a3b30323e3641c028868a8d50525a333a404254"
)
PACKET = np.dtype(
    [("sync", "u1", 2), ("kind", "u1", 2), ("length", "<u2"), ("count", "u1")]
    + [("names", "u1", len(NAMES)), ("ms", "<u4"), ("week", "<u2")]
    + [("acc", "<i4", 3), ("gyr", "<i4", 3), ("navigator", "u1", 102)]
    + [("heat", "<i2"), ("status", "u1", 22), ("sum", "<u2")]
)
STANDARD_G = 9.8106
WEEK_MS = 604_800_000


class InertialLabsWire(Wire):
    """Packets of an INS, in which only the sensor values are filled in."""

    def encode(self, block: Block) -> bytes:
        """Encode each sample as one packet."""
        packets = np.zeros(len(block), PACKET)
        packets["sync"], packets["kind"] = (0xAA, 0x55), (0x01, 0x95)
        packets["length"], packets["count"] = PACKET.itemsize - 2, len(NAMES)
        packets["names"] = np.frombuffer(NAMES, np.uint8)
        packets["ms"] = np.floor(block.t * 1e3 + 1e-6).astype(np.int64) % WEEK_MS
        packets["acc"] = np.rint(block.acc / STANDARD_G * 1e6)
        packets["gyr"] = np.rint(np.rad2deg(block.gyr) * 1e5)
        packets["heat"] = np.rint(np.nan_to_num(block.temperature) * 10)
        body = packets.view(np.uint8).reshape(len(block), -1)
        packets["sum"] = body[:, 2:-2].sum(axis=1, dtype=np.uint16)
        return packets.tobytes()
