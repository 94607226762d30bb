"""MicroStrain: each sample as a MIP packet of inertial data, 58 bytes.

    0x75 0x65 0x80 length  fields  sums(2)

Big-endian fields of length, descriptor and data: 0x04 acceleration in g and 0x05
angular rate in rad/s, three floats each; 0x14 least, most and mean temperature in
deg C; 0xD5 time since power-up in ns. The sums are Fletcher's over all before them. A g
is 9.80665 m/s^2. Source: MIP protocol, data set 0x80.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.sim_device.earth import STANDARD_GRAVITY
from fieldcal.sim_device.wire import Wire

PACKET = np.dtype(
    [("head", ">u4"), ("acc_id", ">u2"), ("acc", ">f4", 3)]
    + [("gyr_id", ">u2"), ("gyr", ">f4", 3), ("heat_id", ">u2"), ("heat", ">f4", 3)]
    + [("time_id", ">u2"), ("ns", ">u8"), ("sums", "u1", 2)]
)
PAYLOAD = PACKET.itemsize - 6


class MipWire(Wire):
    """Packets of data set 0x80."""

    def encode(self, block: Block) -> bytes:
        """Encode each sample as one packet."""
        packets = np.zeros(len(block), PACKET)
        packets["head"] = 0x75658000 | PAYLOAD
        packets["acc_id"], packets["gyr_id"] = 0x0E04, 0x0E05
        packets["heat_id"], packets["time_id"] = 0x0E14, 0x0AD5
        packets["acc"] = block.acc / STANDARD_GRAVITY
        packets["gyr"] = block.gyr
        packets["heat"] = block.temperature[:, None]
        packets["ns"] = np.rint(block.t * 1e9)
        body = packets.view(np.uint8).reshape(len(block), -1)[:, :-2]
        running = np.cumsum(body, axis=1, dtype=np.uint8)
        packets["sums"][:, 0] = running[:, -1]
        packets["sums"][:, 1] = running.sum(axis=1, dtype=np.uint8)
        return packets.tobytes()
