"""VectorNav's text line: each sample as $VNIMU with a checksum of NMEA 0183.

    $VNIMU,MagX,MagY,MagZ,AccelX,AccelY,AccelZ,GyroX,GyroY,GyroZ,Temp,Pressure*hh

with the digits that the device sends: a mm/s^2, a micro-rad/s, a tenth of a degree.
There is no time in it. Source: UM001, asynchronous output of IMU measurements.
"""

from __future__ import annotations

from functools import reduce
from operator import xor

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.sim_device.wire import Wire

LINE = "VNIMU,+00.2200,+00.0800,-00.5300" + ",%+07.3f" * 3 + ",%+010.6f" * 3
REST = ",%+05.1f,+101.300"


class VnimuWire(Wire):
    """Lines of IMU measurements."""

    def encode(self, block: Block) -> bytes:
        """Encode each sample as its line."""
        table = np.column_stack([block.six, block.temperature])
        lines = [(LINE + REST) % tuple(row) for row in table.tolist()]
        return b"".join(_ended(line.encode("ascii")) for line in lines)


def _ended(line: bytes) -> bytes:
    return b"$%b*%02X\r\n" % (line, reduce(xor, line, 0))
