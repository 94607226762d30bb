"""Lines of a receiver by NovAtel that pass on what its IMU counts.

    %RAWIMUSA,2209,491612.254;2209,491612.253588,ea5afe00,32,-25,44,30,60,-10*1fb76c28
    #RAWIMUXA,COM1,0,59.5,FINESTEERING,...;00,41,2209,491674.013,ea59fe00,...*038422a7

Behind the header stand, in the extended ones after two fields more, the week, the
second of the week, a status, and velocity and angle gained since the row before, z, -y
and x of each. How much a count is depends on the IMU. Source: OEM7 Commands and Logs
Reference Manual, RAWIMU, RAWIMUS, RAWIMUX and RAWIMUSX.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Self
from zlib import crc32

from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most

_LINE = re.compile(r"\s*[#%](RAWIMUS?X?A,[^;]*;([^*]*))\*([0-9A-Fa-f]{8})\s*")

_CORRECTED = re.compile(r"\s*[#%]((?:IMURATE)?CORRIMU(?:DATA)?S?A),")

_MESSAGE = re.compile(r"\s*[#%<]\w+,")

FIELDS = 9
"""From the week to the last count."""


class ReceiverLines(TextForm):
    """What the IMU of a receiver counts, by the second of the week."""

    names = ("time [s]", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z")
    gathers = True
    says = "it is the log of a receiver, of which the counts of its IMU alone are read"

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        return (
            cls()
            if is_true_of_most(lines, lambda line: _row(line) is not None)
            else None
        )

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def read(lines: Sequence[str]) -> list[str]:
            found = []
            for line in lines:
                row = _row(line)
                if row is not None:
                    found.append(row)
                elif "RAWIMU" in line or not _MESSAGE.match(line):
                    # a line that fails its check is no row: whoever reads rows says so
                    found.append(line)
            return found

        return read


def corrected_messages(lines: Sequence[str]) -> str:
    """Name of messages of which the receiver has taken what a sensor shows; or "".

    >>> corrected_messages(["%CORRIMUDATASA,2209,4.0;2209,4.0,0,0,0,0,0,0*12345678"])
    'CORRIMUDATASA'
    """
    said = (_CORRECTED.match(line) for line in lines)
    return next((one[1] for one in said if one is not None), "")


def _row(line: str) -> str | None:
    """Second and counts x, y, z of both sensors; None if the line is no such message.

    >>> _row("%RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,"
    ...      "-2706935,4508389,196192,417138,-1000837*038422a7")
    '491674.013699,4508389,2706935,329308016,-1000837,-417138,196192'
    """
    said = _LINE.fullmatch(line)
    if said is None or _checksum(said[1].encode()) != int(said[3], 16):
        return None
    fields = [field.strip() for field in said[2].split(",")]
    if len(fields) < FIELDS:
        return None
    second, (az, ay, ax, gz, gy, gx) = fields[-FIELDS + 1], fields[-6:]
    return ",".join([second, ax, _other_way(ay), az, gx, _other_way(gy), gz])


def _other_way(count: str) -> str:
    return count[1:] if count.startswith("-") else f"-{count}"


def _checksum(data: bytes) -> int:
    """CRC-32 that begins with 0 and is not inverted at its end."""
    return crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
