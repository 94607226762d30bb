"""VectorNav's text line $VNIMU: ``format=vnimu``.

    $VNIMU,MagX,MagY,MagZ,AccelX,AccelY,AccelZ,GyroX,GyroY,GyroZ,Temp,Pressure*hh

in m/s^2, rad/s, deg C; uncompensated, without a time: ``rate=``, or the arrivals.
Source: VectorNav UM001, asynchronous output type IMU measurements.
"""

from __future__ import annotations

from fieldcal.core.samples import Grain
from fieldcal.drivers.codec import FormatMatch
from fieldcal.drivers.options import Options
from fieldcal.drivers.protocols.text import TextCodec


class VnimuCodec(TextCodec):
    """Decoder of lines with these columns."""

    bauds = (115200, 921600, 230400, 460800, 57600, 128000)

    def __init__(self, options: Options) -> None:
        fixed = options.with_fixed(
            columns="-,-,-,ax,ay,az,gx,gy,gz,temperature,-",
            prefix="VNIMU",
            checksum="xor",
        )
        super().__init__(fixed)

    @property
    def grain(self) -> Grain:
        """The last digit of a line."""
        return Grain(1e-3, 1e-6)

    @classmethod
    def match(cls, data: bytes, seconds: float) -> FormatMatch | None:
        """Judge whether bytes are such lines."""
        return cls.match_decoded(data)
