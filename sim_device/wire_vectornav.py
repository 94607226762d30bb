"""VectorNav: each sample as a binary output message of 58 bytes.

    0xFA 0x01 0x0601(2)  TimeStartup(8) Imu(24) MagPres(20)  CRC(2)

little-endian, but for the CRC: TimeStartup in ns; Imu uncompensated accelerations,
m/s^2, and angular rates, rad/s, as floats; MagPres magnetic field, temperature in deg C
and pressure. CRC-16/XMODEM over all but the first byte. Source: UM001, section 4.
"""

from __future__ import annotations

from binascii import crc_hqx

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.sim_device.wire import Wire

MESSAGE = np.dtype(
    [("sync", "u1"), ("groups", "u1"), ("fields", "<u2"), ("ns", "<u8")]
    + [("imu", "<f4", 6), ("field", "<f4", 3), ("temperature", "<f4")]
    + [("pressure", "<f4"), ("crc", ">u2")]
)

FIELD = (0.22, 0.08, -0.53)
PRESSURE = 101.3
"""What the device would see of the rest: gauss, kPa."""


class VectornavWire(Wire):
    """Binary output messages of the common group."""

    def encode(self, block: Block) -> bytes:
        """Encode each sample as one message."""
        messages = np.zeros(len(block), MESSAGE)
        messages["sync"], messages["groups"], messages["fields"] = 0xFA, 0x01, 0x0601
        messages["ns"] = np.rint(block.t * 1e9)
        messages["imu"] = block.six
        messages["temperature"] = block.temperature
        messages["field"], messages["pressure"] = FIELD, PRESSURE
        for message in messages:
            message["crc"] = crc_hqx(message.tobytes()[1:-2], 0)
        return messages.tobytes()
